"""Loop subdivision surfaces: a control mesh, refined and pushed to its limit surface.

C. Loop, "Smooth Subdivision Surfaces Based on Triangles" (1987), with the boundary rules and limit masks of
H. Hoppe et al., "Piecewise Smooth Surface Reconstruction" (SIGGRAPH 1994). pbrt's `loopsubdiv` uses the same masks,
so both renderers see the same triangles and the same shading normals.
"""

import numpy as np

CORNERS = 3


class Topology:
    """Half-edges of a consistently oriented triangle mesh.

    Half-edge `3f + c` runs along face `f` from corner `c` to corner `c + 1`; `twin` is the half-edge that runs back
    in the neighbouring face, or -1 on the boundary.
    """

    def __init__(self, faces, vertex_count):
        self.origin = faces.reshape(-1)
        self.target = np.roll(faces, -1, axis=1).reshape(-1)
        self.apex = np.roll(faces, -2, axis=1).reshape(-1)
        ends = np.sort(np.stack([self.origin, self.target], axis=1), axis=1)
        self.edges, self.edge_of, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
        self.edge_of = self.edge_of.reshape(-1)
        if uses.max() > 2:
            raise ValueError("loopsubdiv: an edge is shared by more than two faces")

        self.boundary_edge = uses == 1
        by_edge = np.argsort(self.edge_of, kind="stable")
        first = np.concatenate([[0], np.cumsum(uses)[:-1]])
        one, two = by_edge[first], by_edge[first + uses - 1]
        self.twin = np.full(len(self.origin), -1)
        inner = ~self.boundary_edge
        self.twin[one[inner]], self.twin[two[inner]] = two[inner], one[inner]
        if np.any(self.origin[one[inner]] != self.target[two[inner]]):
            raise ValueError("loopsubdiv: two neighbouring faces have opposite orientation")

        self.valence = np.bincount(self.edges.reshape(-1), minlength=vertex_count)
        rim = np.bincount(self.edges[self.boundary_edge].reshape(-1), minlength=vertex_count)
        if np.any((rim != 0) & (rim != 2)):
            raise ValueError("loopsubdiv: a vertex joins more than one fan of faces")
        self.boundary = rim == 2

    def neighbour_sum(self, points, boundary_only=False):
        """For each vertex the sum of its neighbours' points."""
        edges = self.edges[self.boundary_edge] if boundary_only else self.edges
        total = np.zeros_like(points)
        np.add.at(total, edges[:, 0], points[edges[:, 1]])
        np.add.at(total, edges[:, 1], points[edges[:, 0]])
        return total

    def smooth(self, points, inner_weight, boundary_weight):
        """Each vertex blended with its neighbours, by the weight that each neighbour gets."""
        w = inner_weight[:, None]
        inner = (1 - self.valence[:, None] * w) * points + w * self.neighbour_sum(points)
        rim = (1 - 2 * boundary_weight) * points + boundary_weight * self.neighbour_sum(points, boundary_only=True)
        return np.where(self.boundary[:, None], rim, inner)


def loop_beta(valence):
    """The weight of each neighbour in the refinement of an inner vertex (Warren's form; 1/16 for valence 6)."""
    return np.where(valence == 3, 3 / 16, 3 / (8 * np.maximum(valence, 1)))


def refine(points, faces):
    """One level: every triangle becomes four."""
    t = Topology(faces, len(points))
    even = t.smooth(points, loop_beta(t.valence), 1 / 8)

    ends = points[t.edges[:, 0]] + points[t.edges[:, 1]]
    apexes = np.zeros_like(ends)
    np.add.at(apexes, t.edge_of, points[t.apex])
    odd = np.where(t.boundary_edge[:, None], ends / 2, 3 / 8 * ends + 1 / 8 * apexes)

    e = t.edge_of.reshape(-1, CORNERS) + len(points)
    v0, v1, v2 = faces.T
    e0, e1, e2 = e.T
    quads = [(v0, e0, e2), (v1, e1, e0), (v2, e2, e1), (e0, e1, e2)]
    return np.concatenate([even, odd]), np.concatenate([np.stack(q, axis=1) for q in quads])


def limit_normals(points, faces, t):
    """Unit normals from the tangent masks, on the side to which the faces' own winding points."""
    start = np.full(len(points), -1)
    start[t.origin] = np.arange(len(t.origin))
    open_edge = t.twin < 0
    start[t.origin[open_edge]] = np.flatnonzero(open_edge)
    if np.any(start < 0):
        raise ValueError("loopsubdiv: a vertex belongs to no face")

    n = t.valence
    previous = np.arange(len(t.origin)).reshape(-1, CORNERS)[:, [2, 0, 1]].reshape(-1)
    across, along = np.zeros_like(points), np.zeros_like(points)
    half_edge = start.copy()
    ring_point = points[t.target[start]]
    for j in range(n.max()):
        a, b = _tangent_weights(n, t.boundary, j)
        live = j < n
        across += np.where(live, a, 0)[:, None] * ring_point
        along += np.where(live, b, 0)[:, None] * ring_point
        back = previous[half_edge]
        onward = t.twin[back]
        # At the end of an open fan there is no next half-edge; the last neighbour is where the last face comes from.
        ring_point = np.where((onward < 0)[:, None], points[t.origin[back]], points[t.target[onward]])
        half_edge = np.where(onward < 0, half_edge, onward)
    along += np.where(t.boundary, _centre_weight(n), 0)[:, None] * points

    normals = np.cross(across, along)
    corner = points[faces]
    winding = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    outward = np.zeros_like(points)
    for c in range(CORNERS):
        np.add.at(outward, faces[:, c], winding)
    normals *= np.where(np.sum(normals * outward, axis=1) < 0, -1, 1)[:, None]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-300), outward)


def _tangent_weights(n, boundary, j):
    """Weights of the j-th ring neighbour in the two tangents, for each vertex of valence n."""
    angle = 2 * np.pi * j / np.maximum(n, 1)
    rim_across = np.where(j == n - 1, 1.0, 0.0) - (1.0 if j == 0 else 0.0)
    theta = np.pi / np.maximum(n - 1, 1)
    end = (j == 0) | (j == n - 1)
    rim_along = -np.where(end, np.sin(theta), (2 * np.cos(theta) - 2) * np.sin(j * theta))
    rim_along = np.where(n == 2, 1.0, rim_along)
    rim_along = np.where(n == 3, 1.0 if j == 1 else 0.0, rim_along)
    rim_along = np.where(n == 4, np.where(end, -1.0, 2.0), rim_along)
    return np.where(boundary, rim_across, np.cos(angle)), np.where(boundary, rim_along, np.sin(angle))


def _centre_weight(n):
    """Weight of a boundary vertex itself in the tangent that leaves the boundary."""
    return np.select([n == 2, n == 3, n == 4], [-2.0, -1.0, -2.0], 0.0)


def loop_subdivide(points, faces, levels):
    """(points, normals, faces) of the surface after `levels` refinements, on the limit surface."""
    for _ in range(levels):
        points, faces = refine(points, faces)
    t = Topology(faces, len(points))
    gamma = 1 / (t.valence + 3 / (8 * loop_beta(t.valence)))
    points = t.smooth(points, gamma, 1 / 5)
    return points, limit_normals(points, faces, t), faces
