//! Walks from either end of a path.

use super::path::Node;
use super::space::{Bounce, PathSpace, Scattering, Side, scattering_along};
use luz_color::SampledSpectrum;
use luz_sample::Samples;
use luz_sample::roulette::{Limits, throughput_survival};
use std::cell::OnceCell;

/// A walk from the light or from the eye, vertex by vertex, in the order in which it was made.
#[derive(Clone, Debug)]
pub struct Subpath<V> {
    side: Side,
    /// Each with the geometry factor of the edge to the next; factors are known of all but the last.
    pub(super) nodes: Vec<Node<V>>,
    /// The density with which the walk has made each vertex, in the vertex's measure; without roulette.
    pub(super) densities: Vec<f32>,
    /// Contribution over density of all before the vertex; with roulette.
    throughputs: Vec<SampledSpectrum>,
    /// [`direct_density`](Self::direct_density), once it has been asked for: it is the same for all connections of the walk.
    direct_density: OnceCell<f32>,
}

impl<V: Clone> Subpath<V> {
    /// A walk of no vertices.
    pub fn new(side: Side) -> Self {
        Self {
            side,
            nodes: Vec::new(),
            densities: Vec::new(),
            throughputs: Vec::new(),
            direct_density: OnceCell::new(),
        }
    }

    /// How many vertices it has.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Has it none?
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Where it began.
    pub fn side(&self) -> Side {
        self.side
    }

    /// Its vertex number `i`, counted from where it began.
    pub fn vertex(&self, i: usize) -> Option<&V> {
        self.nodes.get(i).map(|node| &node.vertex)
    }

    /// The weight of a vertex: the factors of all before it over their densities, the geometry of edges cancelled.
    pub fn throughput(&self, i: usize) -> SampledSpectrum {
        self.throughputs.get(i).copied().unwrap_or(SampledSpectrum::ZERO)
    }

    /// The density with which next-event estimation, from the second vertex of a walk from the light, makes the first.
    pub(super) fn direct_density<P: PathSpace<Vertex = V>>(&self, space: &P) -> Option<f32> {
        let (x0, x1) = (self.vertex(0)?, self.vertex(1)?);
        Some(*self.direct_density.get_or_init(|| space.direct_density(x1, x0)))
    }

    /// Forgets all vertices.
    pub fn clear(&mut self) {
        self.direct_density.take();
        self.nodes.clear();
        self.densities.clear();
        self.throughputs.clear();
    }

    /// Begins anew, at a vertex drawn with a density.
    pub fn restart(&mut self, vertex: V, density: f32) {
        self.clear();
        self.nodes.push(Node { vertex, bounce: Bounce::Spread, geometry: 0.0, scattering: Scattering::NONE });
        self.densities.push(density);
        self.throughputs.push(SampledSpectrum::splat(1.0 / density));
    }

    /// Begins anew, with a vertex of the space's choice. False, and no vertices, if there is none.
    pub fn begin<P: PathSpace<Vertex = V>>(&mut self, space: &P, samples: &mut impl Samples) -> bool {
        self.clear();
        let Some(vertex) = space.begin(self.side, samples) else { return false };
        let density = space.begin_density(self.side, &vertex);
        if density > 0.0 && density.is_finite() {
            self.restart(vertex, density);
        }
        !self.is_empty()
    }

    /// The last two vertices: that before the last, if there is one, and the last.
    pub fn end(&self) -> Option<(Option<&V>, &V)> {
        let last = self.nodes.last()?;
        let previous = self.nodes.len().checked_sub(2).map(|i| &self.nodes[i].vertex);
        Some((previous, &last.vertex))
    }

    /// Adds a vertex that the space has found from the last one. Does not, and returns false, if nothing can come of it.
    pub fn push<P: PathSpace<Vertex = V>>(&mut self, space: &P, vertex: V, bounce: Bounce) -> bool {
        let Some((previous, at)) = self.end() else { return false };
        let scattering = scattering_along(space, self.side, previous, at, Some(&vertex), bounce);
        let geometry = space.geometry(at, &vertex);
        let onward = scattering.onward(self.side);
        let density = onward * geometry;
        let throughput = self.throughput(self.len() - 1) * (scattering.value * (1.0 / onward));
        if !(density > 0.0 && density.is_finite()) || throughput.is_black() || !throughput.is_finite() {
            return false;
        }
        if let Some(last) = self.nodes.last_mut() {
            (last.scattering, last.geometry, last.bounce) = (scattering, geometry, bounce);
        }
        self.nodes.push(Node { vertex, bounce: Bounce::Spread, geometry: 0.0, scattering: Scattering::NONE });
        self.densities.push(density);
        self.throughputs.push(throughput);
        true
    }

    /// Plays roulette with the last vertex by how its weight compares with that of the walk's first step. Takes it away and returns
    /// false if it does not survive; else its weight makes up for the chance, of which densities know nothing.
    pub fn survives(&mut self, u: f32) -> bool {
        let (Some(first), Some(last)) = (self.throughputs.get(1).copied(), self.throughputs.last_mut()) else {
            return true;
        };
        // Radiance is compressed on entering a denser medium, to be spread again on leaving it: look at it without this detour.
        let detour: f32 = match self.side {
            Side::Light => 1.0,
            Side::Eye => self.nodes.iter().map(|node| node.scattering.compression).product(),
        };
        let relative = last.zip(first, |now, then| if then > 0.0 { now / then } else { 0.0 });
        let survival = throughput_survival(relative.max_component() * detour, &Limits::ROULETTE);
        *last *= 1.0 / survival;
        if u >= survival {
            self.pop();
        }
        u < survival
    }

    /// Takes the last vertex away.
    pub fn pop(&mut self) {
        self.direct_density.take();
        self.nodes.pop();
        self.densities.pop();
        self.throughputs.pop();
        if let Some(last) = self.nodes.last_mut() {
            (last.bounce, last.geometry, last.scattering) = (Bounce::Spread, 0.0, Scattering::NONE);
        }
    }
}
