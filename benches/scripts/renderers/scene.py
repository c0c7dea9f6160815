"""A glTF binary of tests/scenes, as other renderers want it.

Only what those scenes have is read: triangles with normals in world space, diffuse surfaces, metals
that mirror, clear glass, and one light. What is met beyond that ends the program.
"""
import json
import struct
from dataclasses import dataclass

import numpy as np

COMPONENTS = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
LIGHTS = "KHR_lights_punctual"


@dataclass
class Mesh:
    name: str
    positions: np.ndarray  # n x 3, metres
    normals: np.ndarray  # n x 3
    triangles: np.ndarray  # m x 3
    kind: str  # "diffuse", "metal", "glass" or "lamp"
    colour: np.ndarray  # reflectance, of a lamp radiance in W/(sr m^2)
    ior: float

    @property
    def is_caster(self):
        return self.kind in ("metal", "glass")


@dataclass
class Light:
    kind: str  # "point", "spot" or "directional"
    position: np.ndarray
    direction: np.ndarray  # in which it shines
    intensity: np.ndarray  # W/sr, of directional lights W/m^2
    inner: float  # half angle within which a spot light is even, in radians
    outer: float


@dataclass
class Camera:
    position: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    vertical_angle: float  # in radians


class Scene:
    def __init__(self, path):
        with open(path, "rb") as file:
            data = file.read()
        length = struct.unpack("<I", data[12:16])[0]
        self.gltf = json.loads(data[20 : 20 + length])
        self.binary = data[28 + length :]
        self.meshes, self.light, self.camera = [], None, None
        for node in self.gltf["nodes"]:
            self.add(node)
        del self.gltf, self.binary

    def add(self, node):
        if unknown := {"children", "translation", "rotation", "scale"} & node.keys():
            raise SystemExit(f"nodes with {', '.join(unknown)} are not read")
        matrix = np.array(node.get("matrix", np.eye(4).ravel())).reshape(4, 4).T
        if "mesh" in node:
            if not np.array_equal(matrix, np.eye(4)):
                raise SystemExit("meshes with matrices are not read")
            for primitive in self.gltf["meshes"][node["mesh"]]["primitives"]:
                self.meshes.append(self.mesh(f"mesh{len(self.meshes)}", primitive))
        if "camera" in node:
            axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
            perspective = self.gltf["cameras"][node["camera"]]["perspective"]
            self.camera = Camera(
                matrix[:3, 3], axes[:, 0], axes[:, 1], -axes[:, 2], perspective["yfov"]
            )
        if light := node.get("extensions", {}).get(LIGHTS):
            of = self.gltf["extensions"][LIGHTS]["lights"][light["light"]]
            cone = of.get("spot", {})
            self.light = Light(
                of["type"],
                matrix[:3, 3],
                -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2]),
                np.array(of.get("color", [1, 1, 1])) * of.get("intensity", 1),
                cone.get("innerConeAngle", 0.0),
                cone.get("outerConeAngle", np.pi / 4),
            )

    def array(self, index):
        accessor = self.gltf["accessors"][index]
        view = self.gltf["bufferViews"][accessor["bufferView"]]
        if "byteStride" in view:
            raise SystemExit("interleaved vertices are not read")
        width = WIDTHS[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = accessor["count"] * width
        found = np.frombuffer(self.binary, COMPONENTS[accessor["componentType"]], count, start)
        return found.reshape(-1, width)

    def mesh(self, name, primitive):
        material = self.gltf["materials"][primitive["material"]]
        surface = material["pbrMetallicRoughness"]
        extensions = material.get("extensions", {})
        colour = np.array(surface["baseColorFactor"][:3])
        kind, ior = "diffuse", 1.0
        if "KHR_materials_transmission" in extensions:
            kind, ior = "glass", extensions["KHR_materials_ior"]["ior"]
            if "attenuationColor" in extensions.get("KHR_materials_volume", {}):
                raise SystemExit("glass that absorbs is not read")
        elif surface["metallicFactor"] == 1:
            kind = "metal"
        elif "emissiveFactor" in material:
            kind = "lamp"
            strength = extensions["KHR_materials_emissive_strength"]["emissiveStrength"]
            colour = np.array(material["emissiveFactor"]) * strength
        if kind != "diffuse" and kind != "lamp" and surface["roughnessFactor"] != 0:
            raise SystemExit("rough glass and metal are not read")
        attributes = primitive["attributes"]
        return Mesh(
            name,
            self.array(attributes["POSITION"]),
            self.array(attributes["NORMAL"]),
            self.array(primitive["indices"]).reshape(-1, 3),
            kind,
            colour,
            ior,
        )

    def casters_cone(self):
        """Axis and half angle of a cone from a point or spot light around all glass and metal."""
        points = np.concatenate([mesh.positions for mesh in self.meshes if mesh.is_caster])
        away = points.astype(np.float64) - self.light.position
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        axis = away.max(axis=0) + away.min(axis=0)
        axis /= np.linalg.norm(axis)
        return axis, float(np.arccos(np.clip(away @ axis, -1, 1)).max())
