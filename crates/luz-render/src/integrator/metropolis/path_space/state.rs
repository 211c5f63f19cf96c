//! A state of a chain: a path, with all that it is seen by.

use crate::camera::Camera;
use crate::film::FilmWindow;
use crate::integrator::metropolis::{Importance, scalar_contribution};
use crate::light::{EmittingPoint, LightEnd, Place};
use crate::transport::{Bounce, Path, SceneSpace, SceneVertex, SpecularKind};
use crate::world::World;
use glam::{Vec2, Vec3};
use luz_color::{Sensor, Wavelengths};
use luz_sample::markov::Log;
use serde::{Deserialize, Serialize};

/// The path, the conditions under which it is looked at, and what it shows then.
#[derive(Clone, Debug, Default)]
pub struct State<'w> {
    /// From a light to the eye.
    pub path: Path<SceneVertex<'w>>,
    /// What all its vertices share.
    pub conditions: Conditions,
    /// Where it is seen, in pixels.
    pub film: Vec2,
    /// Its contribution over the target density, in the film's RGB.
    pub rgb: [f32; 3],
}

/// Under which conditions a path is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// The number that the wavelengths are made from.
    pub colour_u: f32,
    /// The number that the moment is made from.
    pub time_u: f32,
    wavelengths: Wavelengths,
}

impl Conditions {
    /// From two numbers in `[0, 1)`.
    pub fn new(colour_u: f32, time_u: f32) -> Self {
        Self { colour_u, time_u, wavelengths: Wavelengths::sample_visible(colour_u) }
    }

    /// The same moment in another light.
    pub fn recoloured(&self, colour_u: f32) -> Self {
        Self::new(colour_u, self.time_u)
    }
}

impl Default for Conditions {
    fn default() -> Self {
        Self::new(0.0, 0.0)
    }
}

/// Where paths are, and how they are measured.
#[derive(Clone, Copy)]
pub struct Measure<'a> {
    /// What paths meet.
    pub world: &'a World,
    /// Where they end.
    pub camera: &'a Camera,
    /// Where on the film they are looked for.
    pub window: FilmWindow,
    /// From radiance to RGB.
    pub sensor: &'a Sensor,
}

impl<'a> Measure<'a> {
    /// The paths under some conditions.
    pub fn space(&self, conditions: &Conditions) -> SceneSpace<'a> {
        SceneSpace::new(self.world, self.camera, self.window, conditions.wavelengths, conditions.time_u)
    }

    /// Looks at a state's path: the logarithm of the target density. Sets where it is seen, and its colour.
    pub fn look(&self, space: &SceneSpace<'a>, importance: &Importance, state: &mut State<'a>) -> Log {
        const NOTHING: Log = Log(f64::NEG_INFINITY);
        let nodes = state.path.nodes();
        let [.., seen, eye] = nodes else { return NOTHING };
        let Some(film) = space.film(&eye.vertex, &seen.vertex) else { return NOTHING };
        let contribution = state.path.contribution();
        let disperses = nodes.iter().any(|node| node.vertex.surface().is_some_and(|surface| surface.disperses));
        let mut wavelengths = *space.wavelengths();
        if disperses {
            wavelengths.terminate_secondary();
        }
        let rgb = self.sensor.to_output_rgb(contribution.spectrum, &wavelengths);
        let magnitude = scalar_contribution(rgb);
        if !(magnitude > 0.0 && magnitude.is_finite()) {
            return NOTHING;
        }
        let importance = importance.at(film);
        state.film = film;
        state.rgb = rgb.map(|v| (f64::from(v) / magnitude * importance) as f32);
        Log(magnitude.ln() + contribution.ln_scale - importance.ln())
    }
}

/// A vertex, as it is kept in files.
#[derive(Serialize, Deserialize)]
enum SavedVertex {
    Camera { lens_u: [f32; 2] },
    Area { light: u32, position: [f32; 3], error: [f32; 3], normal: [f32; 3], uv: [f32; 2], parametric: [f32; 2] },
    Point { light: u32, position: [f32; 3], is_delta: bool },
    Infinity { light: u32, towards: [f32; 3], is_delta: bool },
    Surface { origin: [f32; 3], direction: [f32; 3] },
}

/// A state, as it is kept in files: surfaces by the rays that have found them.
#[derive(Serialize, Deserialize)]
pub struct SavedState {
    colour_u: f32,
    time_u: f32,
    film: [f32; 2],
    rgb: [f32; 3],
    vertices: Vec<(SavedVertex, Option<SpecularKind>)>,
}

impl<'a> State<'a> {
    /// As it is kept in files.
    pub fn save(&self) -> SavedState {
        let save = |vertex: &SceneVertex<'_>| match vertex {
            SceneVertex::Camera(_, lens_u) => SavedVertex::Camera { lens_u: lens_u.to_array() },
            SceneVertex::Surface(surface) => {
                let (origin, direction) = surface.found_by;
                SavedVertex::Surface { origin: origin.to_array(), direction: direction.to_array() }
            }
            SceneVertex::Light(LightEnd { light, place, is_delta }) => match *place {
                Place::Surface(EmittingPoint { position, error, normal, uv, parametric }) => SavedVertex::Area {
                    light: *light,
                    position: position.to_array(),
                    error: error.to_array(),
                    normal: normal.to_array(),
                    uv: uv.to_array(),
                    parametric: parametric.to_array(),
                },
                Place::Point(position) => {
                    SavedVertex::Point { light: *light, position: position.to_array(), is_delta: *is_delta }
                }
                Place::Infinity(towards) => {
                    SavedVertex::Infinity { light: *light, towards: towards.to_array(), is_delta: *is_delta }
                }
            },
        };
        let kind = |bounce| match bounce {
            Bounce::Spread => None,
            Bounce::Specular(kind) => Some(kind),
        };
        let vertices = self.path.nodes().iter().map(|node| (save(&node.vertex), kind(node.bounce))).collect();
        let Self { conditions: Conditions { colour_u, time_u, .. }, film, rgb, .. } = *self;
        SavedState { colour_u, time_u, film: film.to_array(), rgb, vertices }
    }

    /// The state that was saved; `None` if it is none of this scene.
    pub fn restore(saved: &SavedState, measure: &Measure<'a>) -> Option<Self> {
        let SavedState { colour_u, time_u, film, rgb, ref vertices } = *saved;
        let conditions = Conditions::new(colour_u, time_u);
        let space = measure.space(&conditions);
        let lights = measure.world.lights().len();
        let end = |light: u32, place, is_delta| {
            ((light as usize) < lights).then_some(SceneVertex::Light(LightEnd { light, place, is_delta }))
        };
        let mut state = Self { conditions, film: film.into(), rgb, path: Path::default() };
        for (vertex, kind) in vertices {
            let vertex = match *vertex {
                SavedVertex::Camera { lens_u } => space.lens(lens_u.into()),
                SavedVertex::Surface { origin, direction } => {
                    space.find_again((Vec3::from(origin), Vec3::from(direction)))?
                }
                SavedVertex::Area { light, position, error, normal, uv, parametric } => end(
                    light,
                    Place::Surface(EmittingPoint {
                        position: position.into(),
                        error: error.into(),
                        normal: normal.into(),
                        uv: uv.into(),
                        parametric: parametric.into(),
                    }),
                    false,
                )?,
                SavedVertex::Point { light, position, is_delta } => {
                    end(light, Place::Point(position.into()), is_delta)?
                }
                SavedVertex::Infinity { light, towards, is_delta } => {
                    end(light, Place::Infinity(towards.into()), is_delta)?
                }
            };
            state.path.push(vertex, kind.map_or(Bounce::Spread, Bounce::Specular));
        }
        state.path.evaluate(&space, 0..vertices.len());
        (vertices.len() >= 2).then_some(state)
    }
}
