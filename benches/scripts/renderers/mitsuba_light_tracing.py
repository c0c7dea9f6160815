#!/usr/bin/env python3
"""Renders the caustics of a scene with Mitsuba 3's light tracer (`ptracer`):

    python3 mitsuba_light_tracing.py SCENE.glb FOLDER WIDTH HEIGHT

For each picture it prints a line: renderer, version, setting, seconds, the file of the picture, and the file
of what is to be taken off it. Seconds are those of the rendering alone, after a picture of one
sample has compiled it.

Mitsuba's picture has all light. What surfaces get directly from the lamp is a second picture by the
same random numbers with paths of one bounce, which is not timed: off the first it leaves no noise of its
own behind. Diffuse surfaces have a thousandth of their reflectance, for which the pictures are made up,
so that what they throw on each other does not count. `narrow` has a spot light around the glass and metal
in place of a point light. Metals are Mitsuba's conductors with the indices that are nearest to Schlick's
approximation. Needs numpy, mitsuba and a libLLVM of 16 or newer (DRJIT_LIBLLVM_PATH says which one if there
are several).
"""
import os
import sys
import time

import mitsuba as mi
import numpy as np

from scene import Scene

SAMPLES = [4, 16, 64]
DIMMED = 1e-3

mi.set_variant("llvm_ad_rgb")


def conductor(colour):
    """Indices whose reflectance is nearest to Schlick's with that at normal incidence."""
    cosine = np.linspace(0.02, 1, 50)
    eta, k = [], []
    for at_normal in colour:
        wanted = at_normal + (1 - at_normal) * (1 - cosine) ** 5
        real = np.linspace(0.02, 3, 300)
        # From (( n - 1)^2 + k^2) / ((n + 1)^2 + k^2) at normal incidence.
        squared = (at_normal * (real + 1) ** 2 - (real - 1) ** 2) / (1 - at_normal)
        real, imaginary = real[squared > 0], np.sqrt(squared[squared > 0])
        index = (real + 1j * imaginary)[:, None]
        inside = np.sqrt(1 - (1 - cosine**2) / index**2)
        across = (cosine - index * inside) / (cosine + index * inside)
        along = (index * cosine - inside) / (index * cosine + inside)
        reflected = (np.abs(across) ** 2 + np.abs(along) ** 2) / 2
        best = np.argmin(((reflected - wanted) ** 2).sum(axis=1))
        eta.append(real[best])
        k.append(imaginary[best])
    return eta, k


def surface(mesh):
    if mesh.kind == "glass":
        return {"type": "dielectric", "int_ior": mesh.ior, "ext_ior": 1.0}
    if mesh.kind == "metal":
        eta, k = conductor(mesh.colour)
        rgb = [{"type": "rgb", "value": values} for values in (eta, k)]
        return {"type": "twosided", "nested": {"type": "conductor", "eta": rgb[0], "k": rgb[1]}}
    colour = np.zeros(3) if mesh.kind == "lamp" else mesh.colour
    rgb = {"type": "rgb", "value": (DIMMED * colour).tolist()}
    return {"type": "twosided", "nested": {"type": "diffuse", "reflectance": rgb}}


def shape(mesh):
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(surface(mesh))
    if mesh.kind == "lamp":
        radiance = {"type": "rgb", "value": mesh.colour.tolist()}
        properties["emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
    made = mi.Mesh(mesh.name, len(mesh.positions), len(mesh.triangles), properties, True)
    values = mi.traverse(made)
    values["vertex_positions"] = np.ravel(mesh.positions)
    values["vertex_normals"] = np.ravel(mesh.normals)
    values["faces"] = np.ravel(mesh.triangles.astype(np.uint32))
    values.update()
    return made


def pointing(position, direction):
    up = [0, 1, 0] if abs(direction[1]) < 0.9 else [1, 0, 0]
    to_world = mi.ScalarTransform4f()
    return to_world.look_at(position.tolist(), (position + direction).tolist(), up)


def emitters(scene):
    """The scene's light by the names of the renderer's variants."""
    light = scene.light
    if light is None:
        return {"mitsuba-ptracer": None}
    intensity = {"type": "rgb", "value": light.intensity.tolist()}
    if light.kind == "directional":
        direction = light.direction.tolist()
        made = {"type": "directional", "direction": direction, "irradiance": intensity}
        return {"mitsuba-ptracer": made}
    made = {"type": "point", "position": light.position.tolist(), "intensity": intensity}
    axis, angle = scene.casters_cone()
    if light.kind == "spot" and angle + np.arccos(axis @ light.direction) > light.inner:
        raise SystemExit("glass beyond the inner cone of a spot light is not rendered")
    narrow = {
        "type": "spot",
        "to_world": pointing(light.position, axis),
        "intensity": intensity,
        # A beam of even light.
        "beam_width": np.degrees(angle) * 0.999_99,
        "cutoff_angle": np.degrees(angle),
    }
    return {"mitsuba-ptracer": made, "mitsuba-ptracer-narrow": narrow}


def main():
    path, folder, width, height = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    scene = Scene(path)
    camera = scene.camera
    film = {"type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb"}
    film |= {"component_format": "float32", "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "film": film, "fov": np.degrees(camera.vertical_angle)}
    sensor |= {"fov_axis": "y", "near_clip": 0.01, "sampler": {"type": "independent"}}
    target = (camera.position + camera.forward).tolist()
    to_world = mi.ScalarTransform4f()
    sensor["to_world"] = to_world.look_at(camera.position.tolist(), target, camera.up.tolist())
    for name, emitter in emitters(scene).items():
        parts = {"type": "scene", "sensor": sensor}
        parts |= {mesh.name: shape(mesh) for mesh in scene.meshes}
        if emitter:
            parts["emitter"] = emitter
        loaded = mi.load_dict(parts)
        caustics = mi.load_dict({"type": "ptracer", "max_depth": -1})
        direct = mi.load_dict({"type": "ptracer", "max_depth": 2})
        np.array(mi.render(loaded, integrator=caustics, spp=1, seed=1))
        for samples in SAMPLES:
            start = time.perf_counter()
            picture = np.array(mi.render(loaded, integrator=caustics, spp=samples, seed=0))
            seconds = time.perf_counter() - start
            other = np.array(mi.render(loaded, integrator=direct, spp=samples, seed=0))
            files = []
            for kind, image in (("picture", picture), ("direct", other)):
                files.append(os.path.join(folder, f"{name}-{samples}-{kind}.exr"))
                mi.Bitmap(np.ascontiguousarray(image / DIMMED, np.float32)).write(files[-1])
            print(name, mi.__version__, f"{samples}spp", f"{seconds:.4f}", *files, flush=True)


main()
