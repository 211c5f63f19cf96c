//! Joining a walk from the light and a walk from the eye to a path.

use super::space::{Bounce, PathSpace, Scattering, Side};
use super::subpath::Subpath;
use super::technique::{Densities, Techniques};
use luz_color::SampledSpectrum;
use luz_sample::Samples;
use luz_sample::mis::Heuristic;

/// A path of `s` vertices from the light and `t` from the eye.
#[derive(Clone, Debug)]
pub struct Connection<V> {
    /// `f(x)` over the density of technique `(s, t)`, roulette included.
    pub value: SampledSpectrum,
    /// The weight of the technique among all that could have made the path.
    pub weight: f32,
    /// The `x₀` that stands for the one of the light's walk, where that is the only vertex from there (`s = 1`), or in which the
    /// walk from the eye ended (`s = 0`).
    pub light: Option<V>,
}

/// Memory that connections are worked out in.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    densities: Vec<Densities>,
    counts_and_pdfs: Vec<(f32, f32)>,
}

/// The two vertices that meet, and what is between them.
struct Joint {
    geometry: f32,
    light: Scattering,
    eye: Scattering,
}

/// Connects the first `s` vertices of a walk from the light with the first `t ≥ 1` of one from the eye; `None` if no light goes
/// that way.
///
/// For `s = 0` the eye's last vertex is the light; for `s = 1` a new `x₀` is drawn, from `samples`, as seen from the eye's last
/// vertex, unless that is the eye itself.
pub fn connect<P: PathSpace>(
    space: &P,
    (light, s): (&Subpath<P::Vertex>, usize),
    (eye, t): (&Subpath<P::Vertex>, usize),
    heuristic: Heuristic,
    samples: &mut impl Samples,
    scratch: &mut Scratch,
) -> Option<Connection<P::Vertex>> {
    let z = eye.vertex(t.checked_sub(1)?)?;
    let behind = t.checked_sub(2).and_then(|i| eye.vertex(i));
    let eye_throughput = eye.throughput(t - 1);
    match s {
        0 => {
            let x0 = space.as_light(z)?;
            let scattering = space.scattering(None, &x0, Some(behind?), Bounce::Spread);
            let value = eye_throughput * scattering.value;
            if value.is_black() {
                return None;
            }
            let first = space.begin_density(Side::Light, &x0);
            // The light in front of the camera is no matter of next-event estimation.
            let direct = if t == 2 { first } else { space.direct_density(behind?, &x0) };
            let joint = Joint { geometry: 0.0, light: Scattering::NONE, eye: scattering };
            let weight = weigh(space, (light, 0), (eye, t), &joint, (first, direct, true), heuristic, scratch);
            Some(Connection { value, weight, light: Some(x0) })
        }
        1 => {
            if !space.is_connectable(z) {
                return None;
            }
            let (x0, direct) = if t == 1 {
                let x0 = light.vertex(0)?.clone();
                // A point that is seen from a point is on no pixel.
                if !space.can_be_hit(&x0) {
                    return None;
                }
                (x0, light.densities[0])
            } else {
                space.direct(z, samples)?
            };
            let light_throughput = SampledSpectrum::splat(1.0 / direct);
            let (joint, value) = join(space, (None, &x0, light_throughput), (z, behind, eye_throughput))?;
            let first = space.begin_density(Side::Light, &x0);
            let ends = (first, direct, space.can_be_hit(&x0));
            let weight = weigh(space, (light, 1), (eye, t), &joint, ends, heuristic, scratch);
            Some(Connection { value, weight, light: Some(x0) })
        }
        _ => {
            let y = light.vertex(s - 1)?;
            if !space.is_connectable(z) || !space.is_connectable(y) {
                return None;
            }
            let before = light.vertex(s - 2);
            let (joint, value) = join(space, (before, y, light.throughput(s - 1)), (z, behind, eye_throughput))?;
            let ends = (light.densities[0], light.direct_density(space)?, space.can_be_hit(light.vertex(0)?));
            let weight = weigh(space, (light, s), (eye, t), &joint, ends, heuristic, scratch);
            Some(Connection { value, weight, light: None })
        }
    }
}

fn join<P: PathSpace>(
    space: &P,
    (before, y, light_throughput): (Option<&P::Vertex>, &P::Vertex, SampledSpectrum),
    (z, behind, eye_throughput): (&P::Vertex, Option<&P::Vertex>, SampledSpectrum),
) -> Option<(Joint, SampledSpectrum)> {
    let geometry = space.geometry(y, z);
    if !(geometry > 0.0 && geometry.is_finite()) {
        return None;
    }
    let at_light = space.scattering(before, y, Some(z), Bounce::Spread);
    if at_light.value.is_black() {
        return None;
    }
    let at_eye = space.scattering(Some(y), z, behind, Bounce::Spread);
    let value = light_throughput * at_light.value * geometry * at_eye.value * eye_throughput;
    if value.is_black() || !value.is_finite() || !space.is_visible(z, y) {
        return None;
    }
    Some((Joint { geometry, light: at_light, eye: at_eye }, value))
}

/// The weight of technique `(s, t)`, given the densities of `x₀` by emission and as seen from `x₁`, and whether it can be hit.
fn weigh<P: PathSpace>(
    space: &P,
    (light, s): (&Subpath<P::Vertex>, usize),
    (eye, t): (&Subpath<P::Vertex>, usize),
    joint: &Joint,
    (first, direct, can_hit_light): (f32, f32, bool),
    heuristic: Heuristic,
    scratch: &mut Scratch,
) -> f32 {
    let n = s + t;
    scratch.densities.clear();
    for i in 0..n {
        let vertex = if i < s {
            let from_light = if i == 0 { first } else { light.densities[i] };
            let from_eye = match s - 1 - i {
                0 => joint.eye.toward_light * joint.geometry,
                1 => joint.light.toward_light * light.nodes[i].geometry,
                _ => light.nodes[i + 1].scattering.toward_light * light.nodes[i].geometry,
            };
            let is_connectable = match s - 1 - i {
                0 => true,
                _ => !light.nodes[i].bounce.is_specular() && space.is_connectable(&light.nodes[i].vertex),
            };
            Densities { from_light, from_eye, is_connectable }
        } else {
            let j = n - 1 - i;
            let from_eye = eye.densities[j];
            // The edge by which the walk came to its vertex j ends in vertex j + 1, from which the light's walk would come.
            let from_light = match t - 1 - j {
                0 if s == 0 => first,
                0 => joint.light.toward_eye * joint.geometry,
                1 => joint.eye.toward_eye * eye.nodes[j].geometry,
                _ => eye.nodes[j + 1].scattering.toward_eye * eye.nodes[j].geometry,
            };
            let is_connectable = match t - 1 - j {
                0 => true,
                _ => !eye.nodes[j].bounce.is_specular() && space.is_connectable(&eye.nodes[j].vertex),
            };
            Densities { from_light, from_eye, is_connectable }
        };
        scratch.densities.push(vertex);
    }
    let techniques = Techniques { vertices: &scratch.densities, direct, can_hit_light };
    techniques.weight(heuristic, s, &mut scratch.counts_and_pdfs)
}
