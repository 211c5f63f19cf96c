//! Area-preserving maps from the unit square or interval to the domains of light transport, each with its density.
//!
//! Every map takes `u ∈ [0, 1)` (or `[0, 1)²`), never fails, and stays finite at `u = 0` and at the largest `u` below one.
//! The density of `foo` is `foo_pdf`; where the map is simple to undo, `foo_inverse` gives back `u`. Directions are unit
//! vectors around +z, as in local shading space; densities of directions are in solid angle (sr⁻¹), those of points in
//! area, those of numbers in length.

mod bilinear;
mod cone;
mod disk;
mod exponential;
mod hemisphere;
mod linear;
mod normal;
mod sphere;
mod spherical_rectangle;
mod spherical_triangle;
mod tent;
mod triangle;

pub use bilinear::{bilinear, bilinear_inverse, bilinear_pdf, bilinear_with_pdf};
pub use cone::{one_minus_cos_of_sin_squared, uniform_cone, uniform_cone_inverse, uniform_cone_pdf};
pub use disk::{concentric_disk, concentric_disk_inverse, concentric_disk_pdf};
pub use exponential::{exponential, exponential_inverse, exponential_pdf};
pub use hemisphere::{
    cosine_hemisphere, cosine_hemisphere_inverse, cosine_hemisphere_pdf, uniform_hemisphere,
    uniform_hemisphere_inverse, uniform_hemisphere_pdf,
};
pub use linear::{linear, linear_inverse, linear_pdf};
pub use normal::{box_muller, box_muller_pdf, normal, normal_pdf, normal_quantile};
pub use sphere::{uniform_sphere, uniform_sphere_inverse, uniform_sphere_pdf};
pub use spherical_rectangle::SphericalRectangle;
pub use spherical_triangle::{SphericalTriangle, SphericalTriangleSample};
pub use tent::{tent, tent_inverse, tent_pdf};
pub use triangle::{uniform_triangle, uniform_triangle_inverse, uniform_triangle_pdf};
