//! Monte Carlo imaging: a spectral path tracer that reads pbrt-v4 scenes.
//!
//! Everything here is an estimator `1/n · Σ w(xᵢ) f(xᵢ) / p(xᵢ)`, and every result carries its error.
//!
//! ```
//! let text = r#"
//!     Film "rgb" "integer xresolution" 16 "integer yresolution" 16
//!     Sampler "sobol" "integer pixelsamples" 4
//!     Camera "perspective" "float fov" 40
//!     WorldBegin
//!     LightSource "infinite" "rgb L" [ 1 1 1 ]
//!     Translate 0 0 5
//!     Material "diffuse" "rgb reflectance" [ 0.8 0.2 0.1 ]
//!     Shape "sphere"
//! "#;
//! let scene = luz::Scene::from_text("a red ball", text)?;
//! let film = scene.render();
//! assert!(film.relative_error() < 0.2);
//! let image = film.to_image()?; // R, G, B, and the variance of each
//! # let path = std::env::temp_dir().join(format!("luz-doc-{}.exr", std::process::id()));
//! image.write(&path)?; // by its extension: linear OpenEXR
//! # std::fs::remove_file(path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The rooms of the house, each a crate of its own:
//!
//! * [`sample`]: random numbers, low-discrepancy sequences, warps, distributions, multiple importance sampling
//! * [`color`]: wavelengths, spectra, colour spaces, sensors
//! * [`image`]: images, their files, tone mapping, metrics
//! * [`filter`]: the bilateral filter, sampled and exact, and its uses
//! * [`geometry`]: vectors, transforms, shapes, ray intersection
//! * [`scene`]: scenes as plain data, and their readers
//! * [`render`]: world, textures, BSDFs, lights, cameras, film, integrators
//!
//! and [`study`]: what an estimator does, measured and shown on a page.

pub use luz_color as color;
pub use luz_filter as filter;
pub use luz_geometry as geometry;
pub use luz_image as image;
pub use luz_render as render;
pub use luz_sample as sample;
pub use luz_scene as scene;

pub mod checkpoint;
mod open;
pub mod study;

pub use open::{OpenTimes, Scene};
