#!/usr/bin/env python3
"""Renders the caustics of a scene with POV-Ray's photon map:

    python3 povray_photons.py SCENE.glb FOLDER WIDTH HEIGHT

For each picture it prints a line: renderer, version, setting, seconds, the file of the picture, and the file
of what is to be taken off it. Seconds are those that POV-Ray says it took to shoot photons and to
render, not to read the scene.

POV-Ray's picture has direct light, too, and what glass and mirrors show. The direct light is that of a
second picture, which is not timed, without photons and with casters that are black and cast whole
shadows; casters' own pixels are not scored. The lamp's colour is its intensity over pi, so that pictures are in
W/(sr m^2). All but the number of photons is as POV-Ray has it by default, but for paths of up to 20
surfaces. `wide` lets it look for photons eight times as far as it finds fit, and for 50 to 100 of them:
by default it finds none between those of a lamp that are far apart, where it draws stripes of dark. Needs
numpy and povray.
"""
import os
import re
import subprocess
import sys

import numpy as np

from scene import Scene

PHOTONS = [100_000, 500_000, 2_000_000]
VARIANTS = {"povray-photons": "", "povray-photons-wide": "radius 0, 8 gather 50, 100"}

# No further picture of a variant follows on one that took so many seconds.
PATIENCE = 20

# So near to the lamp that light falls with the square of the distance in the whole scene.
FADE = 1e-3


def vector(values):
    return "<" + ",".join(f"{value:.9g}" for value in values) + ">"


def finish(mesh, is_black):
    if not mesh.is_caster:
        return f"pigment {{ rgb {vector(mesh.colour)} }} finish {{ ambient 0 diffuse 1 }}"
    black = "finish { ambient 0 diffuse 0 }"
    if is_black:
        return f"pigment {{ rgb 0 }} {black}"
    if mesh.kind == "metal":
        # Schlick's approximation.
        reflection = f"reflection {{ rgb {vector(mesh.colour)}, rgb 1 falloff 5 }}"
        texture = f"pigment {{ rgb 0 }} finish {{ ambient 0 diffuse 0 {reflection} }}"
        return f"{texture} photons {{ target reflection on refraction off collect off }}"
    reflection = "reflection { 0, 1 fresnel on } conserve_energy"
    texture = f"pigment {{ rgbt 1 }} finish {{ ambient 0 diffuse 0 {reflection} }}"
    photons = "photons { target reflection on refraction on collect off }"
    return f"{texture} interior {{ ior {mesh.ior} }} {photons}"


def mesh2(mesh, is_black):
    lists = []
    for name, rows in (
        ("vertex_vectors", mesh.positions),
        ("normal_vectors", mesh.normals),
        ("face_indices", mesh.triangles),
    ):
        lists.append(f"{name} {{ {len(rows)}, {','.join(map(vector, rows))} }}")
    return f"mesh2 {{ {' '.join(lists)} {finish(mesh, is_black)} }}"


def lamp(scene):
    light = scene.light
    if light is None:
        raise SystemExit("lamps with an area are not rendered")
    # Diffuse surfaces have no 1 / pi there.
    if light.kind == "directional":
        far = -100 * light.direction
        return (
            f"light_source {{ {vector(far)} rgb {vector(light.intensity / np.pi)} "
            "parallel point_at 0 }"
        )
    axis, angle = scene.casters_cone()
    if light.kind == "spot" and angle + np.arccos(axis @ light.direction) > light.inner:
        raise SystemExit("glass beyond the inner cone of a spot light is not rendered")
    colour = light.intensity / np.pi / (2 * FADE**2)
    return (
        f"light_source {{ {vector(light.position)} rgb {vector(colour)} "
        f"fade_distance {FADE} fade_power 2 }}"
    )


def description(scene, width, height, photons, search):
    camera = scene.camera
    up = 2 * np.tan(camera.vertical_angle / 2) * camera.up
    right = 2 * np.tan(camera.vertical_angle / 2) * width / height * camera.right
    settings = "assumed_gamma 1 max_trace_level 20"
    if photons:
        settings += f" photons {{ count {photons} {search} max_trace_level 20 }}"
    parts = [
        "#version 3.7;",
        f"global_settings {{ {settings} }}",
        f"camera {{ perspective location {vector(camera.position)} right {vector(right)} "
        f"up {vector(up)} direction {vector(camera.forward)} }}",
        lamp(scene),
    ]
    parts += [mesh2(mesh, not photons) for mesh in scene.meshes]
    return "\n".join(parts)


def seconds(report):
    """What the statistics say of photons and of tracing."""
    of = {}
    for line in report.splitlines():
        found = re.match(r"\s*(Photon|Trace|Render)[^:]*Time:.*\(([0-9.]+) seconds\)", line)
        if found:
            of[found[1]] = float(found[2])
    return sum(of.values())


def render(scene, folder, width, height, name, photons, search):
    source = os.path.join(folder, f"{name}-{photons}.pov")
    picture = os.path.join(folder, f"{name}-{photons}.exr")
    with open(source, "w") as file:
        file.write(description(scene, width, height, photons, search))
    command = ["povray", f"+I{source}", f"+O{picture}", f"+W{width}", f"+H{height}"]
    command += ["+FE", "-D", "-P", "File_Gamma=1.0"]
    done = subprocess.run(command, capture_output=True, text=True)
    os.remove(source)
    if done.returncode:
        raise SystemExit(done.stderr.strip().splitlines()[-1])
    return picture, done.stderr


def main():
    path, folder, width, height = sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4])
    scene = Scene(path)
    direct, report = render(scene, folder, width, height, "povray-direct", 0, "")
    version = re.search(r"Version (\S+)", report)[1]
    for name, search in VARIANTS.items():
        for photons in PHOTONS:
            picture, report = render(scene, folder, width, height, name, photons, search)
            taken = seconds(report)
            setting = f"{photons // 1000}k"
            files = (picture, direct)
            print(name, version, setting, f"{taken:.3f}", *files, flush=True)
            if taken > PATIENCE:
                break


main()
