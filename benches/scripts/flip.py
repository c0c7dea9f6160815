#!/usr/bin/env python3
"""Mean LDR-FLIP (Andersson et al. 2020, 67 pixels per degree) of linear images against a reference:

    python3 flip.py REFERENCE.pfm TEST.pfm [TEST.pfm ...]

prints one number a line. Both images are multiplied by one exposure, which maps the 97th percentile
of the reference's lit pixels to 0.8, clamped to 0..1 and encoded as sRGB. Needs numpy and the
package flip-evaluator.
"""
import sys

import flip_evaluator
import numpy as np


def read_pfm(path):
    with open(path, "rb") as file:
        kind = file.readline().strip()
        if kind != b"PF":
            raise SystemExit(f"{path}: not a colour PFM")
        width, height = map(int, file.readline().split())
        order = "<f4" if float(file.readline()) < 0 else ">f4"
        pixels = np.frombuffer(file.read(), order).reshape(height, width, 3)
    return pixels[::-1].astype(np.float64)


def exposure(reference):
    lit = reference.mean(-1)
    lit = lit[lit > 0]
    return 0.8 / np.percentile(lit, 97) if lit.size else 1.0


def display(image, scale):
    x = np.clip(np.where(np.isfinite(image), image, 0) * scale, 0, 1)
    curve = 1.055 * np.maximum(x, 1e-9) ** (1 / 2.4) - 0.055
    return np.where(x <= 0.0031308, 12.92 * x, curve).astype(np.float32)


def main():
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    reference = read_pfm(sys.argv[1])
    scale = exposure(reference)
    shown = display(reference, scale)
    for path in sys.argv[2:]:
        test = read_pfm(path)
        if test.shape != reference.shape:
            raise SystemExit(f"{path}: of another size than the reference")
        print(f"{flip_evaluator.evaluate(shown, display(test, scale), 'LDR')[1]:.6f}")


if __name__ == "__main__":
    main()
