"""Turns a scene of `pbrt_scene` into a Mitsuba 3 scene dictionary that describes the same picture.

Where the two renderers' conventions differ:

* pbrt's camera space is left-handed, its image x axis points along +x; Mitsuba's points along -x. World coordinates
  are kept, and the camera's x axis is flipped.
* pbrt's `diffuse` and `conductor` answer on both sides; Mitsuba's need `twosided`.
* Emitters shine to the side of the surface normal. pbrt's normal also turns with ReverseOrientation and with mirroring
  transforms; here the winding of the triangles turns instead.
* pbrt's `maxdepth` counts scattering events, Mitsuba's `max_depth` counts path edges: one more.
* Texture coordinate v grows upwards in pbrt's images, downwards in Mitsuba's.
* pbrt remaps roughness by α = √roughness unless `remaproughness` is false; both use GGX and visible normals.
"""

import hashlib
import math
from pathlib import Path

import numpy as np

from loop_subdivision import loop_subdivide
from pbrt_scene import Unsupported


class Converter:
    """Writes meshes into `folder` (once for all variants) and builds dictionaries for the variant that is set."""

    def __init__(self, scene, folder):
        self.scene = scene
        self.folder = Path(folder)
        self.meshes = {}

    def dictionary(self, mi, width, height, samples, sampler, max_depth):
        result = {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": max_depth + 1},
            "sensor": self._sensor(mi, width, height, samples, sampler),
        }
        names = {}
        for i, shape in enumerate(self.scene.shapes):
            bsdf = self._bsdf(mi, shape.material)
            # Equal materials are one object: Mitsuba's wavefront kernels then have less to choose from.
            name = names.setdefault(_fingerprint(bsdf), f"bsdf{len(names)}")
            if name not in result:
                result[name] = bsdf
            result[f"shape{i}"] = self._shape(mi, i, shape, name)
        for i, light in enumerate(self.scene.lights):
            result[f"light{i}"] = self._light(light)
        return result

    def _sensor(self, mi, width, height, samples, sampler):
        camera = self.scene.camera
        if camera.kind != "perspective":
            raise Unsupported(f"camera {camera.kind}")
        unknown = set(camera.parameters) - {"fov"}
        if unknown:
            raise Unsupported(f"camera parameters {sorted(unknown)}")
        world_from_camera = np.linalg.inv(self.scene.camera_from_world) @ np.diag([-1.0, 1, 1, 1])
        return {
            "type": "perspective",
            "fov": camera.get("fov", [90.0])[0],
            "fov_axis": "smaller",
            "near_clip": 0.01,
            "far_clip": 1e5,
            "to_world": mi.ScalarTransform4f(world_from_camera),
            "sampler": {"type": sampler, "sample_count": samples},
            "film": {
                "type": "hdrfilm",
                "width": width,
                "height": height,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
        }

    # --- shapes ---

    def _shape(self, mi, index, shape, bsdf):
        node, m = shape.node, shape.world_from_object
        flipped = shape.reverse_orientation != (np.linalg.det(m[:3, :3]) < 0)
        if node.kind == "disk":
            _only(node, {"radius"})
            r = node.get("radius", [1.0])[0]
            # In world space the normal of a transformed disk is M⁻ᵀ(0,0,±1); turning it about x flips the normal.
            turn = np.diag([1.0, -1, -1, 1]) if shape.reverse_orientation else np.eye(4)
            result = {"type": "disk", "to_world": mi.ScalarTransform4f(m @ np.diag([r, r, 1.0, 1]) @ turn)}
        elif node.kind == "sphere":
            _only(node, {"radius"})
            to_world = mi.ScalarTransform4f(m @ np.diag([node.get("radius", [1.0])[0]] * 3 + [1.0]))
            result = {"type": "sphere", "to_world": to_world, "flip_normals": shape.reverse_orientation}
        else:
            if index not in self.meshes:
                self.meshes[index] = self._write_mesh(index, shape, flipped)
            path, smooth = self.meshes[index]
            result = {"type": "ply", "filename": str(path), "face_normals": not smooth}
        result["bsdf"] = {"type": "ref", "id": bsdf}
        if shape.area_light is not None:
            result["emitter"] = {"type": "area", "radiance": _rgb(_emission(shape.area_light))}
        return result

    def _write_mesh(self, index, shape, flipped):
        node, m = shape.node, shape.world_from_object
        points = np.array(node.get("P")).reshape(-1, 3)
        faces = np.array(node.get("indices", [0, 1, 2]), dtype=np.int64).reshape(-1, 3)
        normals, uv = node.get("N"), node.get("uv")
        if node.kind == "trianglemesh":
            _only(node, {"P", "indices", "N", "uv"})
        elif node.kind == "loopsubdiv":
            _only(node, {"P", "indices", "levels"})
            points, normals, faces = loop_subdivide(points, faces, int(node.get("levels", [3])[0]))
        else:
            raise Unsupported(f"shape {node.kind}")

        columns = [points @ m[:3, :3].T + m[:3, 3]]
        if normals is not None:
            turned = np.reshape(normals, (-1, 3)) @ np.linalg.inv(m[:3, :3])
            columns.append(turned / np.linalg.norm(turned, axis=1, keepdims=True))
        if uv is not None:
            columns.append(np.array(uv).reshape(-1, 2))
        path = self.folder / f"shape{index}.ply"
        write_ply(path, columns, normals is not None, uv is not None, faces[:, ::-1] if flipped else faces)
        return path, normals is not None

    # --- materials ---

    def _bsdf(self, mi, material):
        if material.kind == "diffuse":
            _only(material, {"reflectance"})
            inner = {"type": "diffuse", "reflectance": self._reflectance(mi, material)}
        elif material.kind == "conductor":
            _only(material, {"eta", "k", "roughness", "remaproughness"})
            roughness = material.get("roughness", [0.0])[0]
            alpha = math.sqrt(roughness) if material.get("remaproughness", [True])[0] else roughness
            inner = {"type": "roughconductor", "distribution": "ggx", "alpha": alpha}
            if alpha < 1e-3:
                inner = {"type": "conductor"}
            inner |= {"eta": self._spectrum(material, "eta"), "k": self._spectrum(material, "k")}
        else:
            raise Unsupported(f"material {material.kind}")
        return {"type": "twosided", "bsdf": inner}

    def _spectrum(self, material, name):
        if material.type_of(name) != "spectrum":
            raise Unsupported(f"conductor without a spectrum for {name}")
        table = np.loadtxt(self.scene.folder / material.get(name)[0])
        return {"type": "spectrum", "value": [(float(w), float(v)) for w, v in table]}

    def _reflectance(self, mi, material):
        kind = material.type_of("reflectance")
        if kind == "texture":
            return self._texture(mi, material.get("reflectance")[0], 1.0)
        if kind not in (None, "rgb"):
            raise Unsupported(f"reflectance as {kind}")
        return _rgb(material.get("reflectance", [0.5] * 3))

    def _texture(self, mi, name, scale):
        node = self.scene.textures[name]
        if node.kind == "scale":
            _only(node, {"tex", "scale"})
            if node.type_of("tex") != "texture" or node.type_of("scale") != "float":
                raise Unsupported("scale texture with anything but a texture and a constant")
            return self._texture(mi, node.get("tex")[0], scale * node.get("scale")[0])
        if node.kind != "imagemap":
            raise Unsupported(f"texture {node.kind}")
        _only(node, {"filename"})
        image = mi.Bitmap(str(self.scene.folder / node.get("filename")[0]))
        image = image.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
        linear = np.clip(np.array(image)[::-1] * scale, 0, 1)
        return {"type": "bitmap", "bitmap": mi.Bitmap(linear.astype(np.float32)), "raw": True, "wrap_mode": "repeat"}

    # --- lights ---

    def _light(self, light):
        if light.node.kind != "distant":
            raise Unsupported(f"light {light.node.kind}")
        _only(light.node, {"L", "scale", "from", "to"})
        start = np.array(light.node.get("from", [0.0, 0, 0]))
        end = np.array(light.node.get("to", [0.0, 0, 1]))
        direction = light.world_from_light[:3, :3] @ (end - start)
        return {
            "type": "directional",
            "direction": [float(d) for d in direction],
            "irradiance": _rgb(_emission(light.node)),
        }


def _emission(node):
    if node.type_of("L") not in (None, "rgb"):
        raise Unsupported(f"light spectrum as {node.type_of('L')}")
    if node.get("twosided", [False])[0]:
        raise Unsupported("two-sided light")
    return [v * node.get("scale", [1.0])[0] for v in node.get("L", [1.0] * 3)]


def _only(node, known):
    unknown = set(node.parameters) - known
    if unknown:
        raise Unsupported(f"{node.kind}: {sorted(unknown)}")


def _rgb(values):
    return {"type": "rgb", "value": [float(v) for v in values]}


def _fingerprint(bsdf):
    def plain(value):
        if isinstance(value, dict):
            return {k: plain(v) for k, v in value.items()}
        if isinstance(value, (str, int, float, list, tuple)):
            return value
        return hashlib.sha256(np.array(value).tobytes()).hexdigest()

    return repr(plain(bsdf))


def write_ply(path, columns, has_normals, has_uv, faces):
    """A little-endian binary PLY of float vertices and triangles."""
    names = ["x", "y", "z"] + ["nx", "ny", "nz"] * has_normals + ["u", "v"] * has_uv
    vertices = np.concatenate(columns, axis=1).astype("<f4")
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    rows = np.empty(len(faces), dtype=[("count", "u1"), ("corner", "<i4", 3)])
    rows["count"], rows["corner"] = 3, faces
    path.write_bytes("\n".join(header).encode() + vertices.tobytes() + rows.tobytes())
