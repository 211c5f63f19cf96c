//! What walks, perturbations and their densities are in the toy space: lookups in its tables.

use super::{FIRST_END, GLOW, GLOWING, KERNELS, Kind, LAMP, SKIES, SPECULAR_KINDS, SPOT, Toy, kind, number};
use luz_color::SampledSpectrum;
use luz_render::transport::{
    Bounce, Extension, Node, PathSpace, PerturbationSpace, Range, Scattering, Side, SpecularKind,
};
use luz_sample::Samples;

/// What walks find where an end is.
fn place_of_end(end: usize) -> usize {
    if end == GLOW { GLOWING } else { end }
}

impl PathSpace for Toy {
    type Vertex = usize;

    fn begin(&self, side: Side, samples: &mut impl Samples) -> Option<usize> {
        let masses = if side == Side::Light { &self.begin_light } else { &self.begin_eye };
        Self::draw(masses.iter().copied(), samples.next_2d().x)
    }

    fn begin_density(&self, side: Side, &vertex: &usize) -> f32 {
        if side == Side::Light { self.begin_light[vertex] } else { self.begin_eye[vertex] }
    }

    fn extend(
        &self,
        side: Side,
        previous: Option<&usize>,
        &at: &usize,
        as_end: bool,
        samples: &mut impl Samples,
    ) -> Option<Extension<usize>> {
        let from = previous.map_or(0, |&previous| self.direction[at][previous]);
        let (walk, specular) = match side {
            Side::Light => (&self.light_walk, &self.light_specular),
            Side::Eye => (&self.eye_walk, &self.eye_specular),
        };
        let masses = specular[at].iter().map(|by_direction| by_direction[from]).chain(walk[from][at]);
        match Self::draw(masses, samples.next_2d().x)? {
            i @ 0..2 => {
                let kind = SPECULAR_KINDS[i];
                let vertex = self.trace(at, self.mate[at][i][from]?, as_end)?;
                Some(Extension { vertex, bounce: Bounce::Specular(kind) })
            }
            i => Some(Extension { vertex: self.trace(at, i - 2, as_end)?, bounce: Bounce::Spread }),
        }
    }

    fn direct(&self, &from: &usize, samples: &mut impl Samples) -> Option<(usize, f32)> {
        let light = Self::draw(self.direct[from].iter().copied(), samples.next_2d().x)?;
        Some((light, self.direct_density(&from, &light)))
    }

    fn direct_density(&self, &from: &usize, &light: &usize) -> f32 {
        self.direct[from][light]
    }

    fn as_light(&self, &vertex: &usize) -> Option<usize> {
        match kind(vertex) {
            Kind::Light => Some(vertex),
            _ => (vertex == GLOWING).then_some(GLOW),
        }
    }

    fn can_be_hit(&self, &end: &usize) -> bool {
        kind(end) == Kind::Light && end != SPOT
    }

    fn choose_end(&self, &at: &usize, found: usize, u: f32) -> usize {
        match self.next_end(at, found) {
            Some(next) if u >= FIRST_END => next,
            _ => found,
        }
    }

    fn end_probability(&self, &at: &usize, &end: &usize) -> f32 {
        if !self.knows_hits || !self.can_be_hit(&end) {
            return 0.0;
        }
        let is_second = |first: usize| self.visible[at][first] && self.next_end(at, first) == Some(place_of_end(end));
        match self.next_end(at, end) {
            Some(_) => FIRST_END,
            None if [LAMP, SKIES[0]].into_iter().any(is_second) => 1.0 - FIRST_END,
            None => 1.0,
        }
    }

    fn is_connectable(&self, &vertex: &usize) -> bool {
        !matches!(kind(vertex), Kind::Surface { spread: false, .. })
    }

    fn geometry(&self, &a: &usize, &b: &usize) -> f32 {
        self.geometry[a][b]
    }

    fn is_visible(&self, &a: &usize, &b: &usize) -> bool {
        self.visible[a][b]
    }

    fn scattering(
        &self,
        light_side: Option<&usize>,
        &at: &usize,
        eye_side: Option<&usize>,
        bounce: Bounce,
    ) -> Scattering {
        let to = |side: Option<&usize>| {
            side.map_or((0, f32::INFINITY), |&side| (self.direction[at][side], self.geometry[at][side]))
        };
        let ((light, light_geometry), (eye, eye_geometry)) = (to(light_side), to(eye_side));
        if light_geometry == 0.0 || eye_geometry == 0.0 {
            return Scattering::NONE;
        }
        match bounce {
            Bounce::Spread => {
                let value = match kind(at) {
                    Kind::Light => self.value[0][at][eye],
                    Kind::Eye => self.value[0][at][light],
                    Kind::Surface { .. } => self.value[eye][at][light],
                };
                Scattering {
                    value: SampledSpectrum::splat(value),
                    toward_light: self.eye_walk[eye][at][light] / light_geometry,
                    toward_eye: self.light_walk[light][at][eye] / eye_geometry,
                    compression: 1.0,
                }
            }
            Bounce::Specular(kind) => {
                let kind = number(kind);
                let compression = eye_geometry / light_geometry;
                let [from_eye, from_light] = if self.compels {
                    [self.eye_specular[at][kind][eye], self.light_specular[at][kind][light]]
                } else {
                    [1.0; 2]
                };
                Scattering {
                    value: SampledSpectrum::splat(self.coefficient[at][kind][eye]),
                    toward_light: from_eye * compression,
                    toward_eye: from_light,
                    compression,
                }
            }
        }
    }
}

impl PerturbationSpace for Toy {
    fn shift(
        &self,
        &eye: &usize,
        &seen: &usize,
        range: Range,
        as_end: bool,
        samples: &mut impl Samples,
    ) -> Option<usize> {
        let masses = self.kernel(range)[self.direction[eye][seen]][eye];
        self.trace(eye, Self::draw(masses.into_iter(), samples.next_2d().x)?, as_end)
    }

    fn shift_density(&self, eye: &usize, from: &usize, to: &usize, range: Range) -> f32 {
        self.turn_density((eye, from), (eye, to), range)
    }

    fn turn(&self, &at: &usize, old: (&usize, &usize), range: Range, samples: &mut impl Samples) -> Option<usize> {
        let masses = self.kernel(range)[self.direction[*old.0][*old.1]][at];
        self.trace(at, Self::draw(masses.into_iter(), samples.next_2d().x)?, false)
    }

    fn turn_density(&self, old: (&usize, &usize), new: (&usize, &usize), range: Range) -> f32 {
        let [old_direction, new_direction] = [old, new].map(|(&a, &b)| self.direction[a][b]);
        let geometry = self.geometry[*new.0][*new.1];
        if geometry > 0.0 { self.kernel(range)[old_direction][*new.0][new_direction] / geometry } else { 0.0 }
    }

    fn follow(&self, _: Side, &previous: &usize, &at: &usize, kind: SpecularKind, as_end: bool) -> Option<usize> {
        self.trace(at, self.mate(at, kind, previous)?, as_end)
    }

    fn turns_by_pixels(&self, nodes: &[Node<usize>], pixels: Range) -> Option<Range> {
        let sum: usize = nodes.iter().map(|node| node.vertex).sum();
        pixels.scaled(if self.ranges_vary { (1 + sum % KERNELS) as f64 } else { 1.0 })
    }
}
