"""Reads the part of pbrt-v4's scene format that the benchmark scenes need.

Anything outside that part raises `Unsupported`: a benchmark that skips a light compares two different scenes.
"""

import gzip
import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

TOKEN = re.compile(r'#[^\n]*|"([^"]*)"|[\[\]]|[^\s\[\]"#]+')

# What the benchmark sets itself, the same for every renderer.
SET_BY_THE_BENCHMARK = {"Film", "Sampler", "Integrator", "PixelFilter", "Accelerator"}


class Unsupported(Exception):
    """The scene uses something that this reader does not know."""


@dataclass
class Node:
    """A directive with a type and parameters: a shape, a light, a material, a texture, the camera."""

    kind: str
    parameters: dict = field(default_factory=dict)

    def get(self, name, default=None):
        return self.parameters.get(name, (None, default))[1]

    def type_of(self, name):
        return self.parameters.get(name, (None, None))[0]


@dataclass
class Shape:
    node: Node
    world_from_object: np.ndarray
    reverse_orientation: bool
    material: Node
    area_light: Node | None


@dataclass
class Light:
    node: Node
    world_from_light: np.ndarray


@dataclass
class Scene:
    folder: Path
    camera: Node = None
    camera_from_world: np.ndarray = None
    shapes: list = field(default_factory=list)
    lights: list = field(default_factory=list)
    textures: dict = field(default_factory=dict)


@dataclass
class State:
    transform: np.ndarray = field(default_factory=lambda: np.eye(4))
    reverse_orientation: bool = False
    material: Node = field(default_factory=lambda: Node("diffuse"))
    area_light: Node | None = None


def tokens(text):
    """Pairs (is a quoted string, text)."""
    for match in TOKEN.finditer(text):
        if not match[0].startswith("#"):
            yield match[1] is not None, match[0] if match[1] is None else match[1]


def read_text(path):
    return gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text()


def read_scene(path):
    path = Path(path)
    reader = _Reader(path)
    reader.run(path)
    if reader.scene.camera is None:
        raise Unsupported("no Camera directive")
    return reader.scene


class _Reader:
    def __init__(self, path):
        self.scene = Scene(path.parent)
        self.state = State()
        self.stack = []
        self.named_materials = {}
        self.named_transforms = {}

    def run(self, path):
        stream = _Tokens(read_text(path))
        while (directive := stream.word()) is not None:
            if directive == "Include":
                self.run(self.scene.folder / stream.string())
            elif directive in SET_BY_THE_BENCHMARK:
                stream.node()
            elif (rule := getattr(self, f"on_{directive}", None)) is not None:
                rule(stream)
            else:
                raise Unsupported(f"{path}: directive {directive}")

    # --- transforms: the current matrix is multiplied from the right ---

    def apply(self, matrix):
        self.state = replace(self.state, transform=self.state.transform @ matrix)

    def on_Translate(self, stream):
        m = np.eye(4)
        m[:3, 3] = stream.numbers(3)
        self.apply(m)

    def on_Scale(self, stream):
        self.apply(np.diag([*stream.numbers(3), 1.0]))

    def on_Rotate(self, stream):
        angle, *axis = stream.numbers(4)
        x, y, z = np.array(axis) / np.linalg.norm(axis)
        s, c = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        m = np.eye(4)
        m[:3, :3] = c * np.eye(3) + s * skew + (1 - c) * np.outer([x, y, z], [x, y, z])
        self.apply(m)

    def on_LookAt(self, stream):
        eye, at, up = np.array(stream.numbers(9)).reshape(3, 3)
        forward = (at - eye) / np.linalg.norm(at - eye)
        right = np.cross(up / np.linalg.norm(up), forward)
        right /= np.linalg.norm(right)
        m = np.eye(4)
        m[:3] = np.stack([right, np.cross(forward, right), forward, eye], axis=1)
        self.apply(np.linalg.inv(m))

    def on_Transform(self, stream):
        self.state = replace(self.state, transform=np.array(stream.bracketed(16)).reshape(4, 4).T)

    def on_ConcatTransform(self, stream):
        self.apply(np.array(stream.bracketed(16)).reshape(4, 4).T)

    def on_CoordSysTransform(self, stream):
        self.state = replace(self.state, transform=self.named_transforms[stream.string()])

    # --- scene structure ---

    def on_WorldBegin(self, stream):
        self.state = State()

    def on_AttributeBegin(self, stream):
        self.stack.append(self.state)

    def on_AttributeEnd(self, stream):
        self.state = self.stack.pop()

    def on_ReverseOrientation(self, stream):
        self.state = replace(self.state, reverse_orientation=not self.state.reverse_orientation)

    def on_Camera(self, stream):
        self.scene.camera = stream.node()
        self.scene.camera_from_world = self.state.transform
        self.named_transforms["camera"] = np.linalg.inv(self.state.transform)

    def on_Material(self, stream):
        self.state = replace(self.state, material=stream.node())

    def on_MakeNamedMaterial(self, stream):
        name, node = stream.string(), Node("", stream.parameters())
        self.named_materials[name] = Node(node.get("type", [""])[0], node.parameters)

    def on_NamedMaterial(self, stream):
        self.state = replace(self.state, material=self.named_materials[stream.string()])

    def on_Texture(self, stream):
        name, _value_type = stream.string(), stream.string()
        self.scene.textures[name] = stream.node()

    def on_AreaLightSource(self, stream):
        self.state = replace(self.state, area_light=stream.node())

    def on_LightSource(self, stream):
        self.scene.lights.append(Light(stream.node(), self.state.transform))

    def on_Shape(self, stream):
        s = self.state
        self.scene.shapes.append(Shape(stream.node(), s.transform, s.reverse_orientation, s.material, s.area_light))


class _Tokens:
    def __init__(self, text):
        self.items = list(tokens(text))
        self.at = 0

    def word(self):
        if self.at == len(self.items):
            return None
        self.at += 1
        return self.items[self.at - 1][1]

    def string(self):
        quoted, text = self.items[self.at]
        if not quoted:
            raise Unsupported(f"expected a string, found {text}")
        self.at += 1
        return text

    def numbers(self, count):
        self.at += count
        return [float(text) for _, text in self.items[self.at - count : self.at]]

    def bracketed(self, count):
        self.at += 1
        values = self.numbers(count)
        self.at += 1
        return values

    def node(self):
        return Node(self.string(), self.parameters())

    def parameters(self):
        """`"type name" value` pairs: name → (type, list of values)."""
        result = {}
        while self.at < len(self.items) and self.items[self.at][0]:
            kind, name = self.string().split()
            if self.items[self.at][1] == "[" and not self.items[self.at][0]:
                end = self.at + 1
                while self.items[end] != (False, "]"):
                    end += 1
                values, self.at = self.items[self.at + 1 : end], end + 1
            else:
                values, self.at = [self.items[self.at]], self.at + 1
            result[name] = (kind, [_value(quoted, text) for quoted, text in values])
        return result


def _value(quoted, text):
    if quoted:
        return text
    return text == "true" if text in ("true", "false") else float(text)
