"""A truth that shares nothing with the programs under test: half-space, projection and picture in NumPy, written from
docs/mathematics.md alone (its section numbers stand below). Small and plain, in no hurry.
"""

import dataclasses
import math

import numpy as np

E, NU = 0.18e6, 0.49  # of the default gel [Pa], [1]
THICKNESS, DIAMETER = 0.040, 0.0006  # of gel and marker [m]
LAYER_CENTRE = np.array([[0, 0, 0.006], [0.0015, 0.0015, 0.008]])  # blue, red [m]
ALONG = 0.003 * (np.arange(24) - 11.5)
MARKERS = LAYER_CENTRE[:, None] + np.array([(x, y, 0) for y in ALONG for x in ALONG])  # (layer, marker, 3), as in 2.1
SHAPE = (480, 640)
BACKGROUND, CONTRAST, BLUR_PX, CROSS_TALK, READ_NOISE = 20.0, 100.0, 0.8, 0.2, 2.0


# Mechanics (1).

def influence(points):
    """Half-space z > 0: displacement [m/N] at `points` (..., 3) by unit forces at the origin, (..., component, force).

    Boussinesq (1885) and Cerruti (1882), as in Johnson, Contact Mechanics, 3.2 and 3.6.
    """
    x, z, r = points[..., :2], points[..., 2], np.linalg.norm(points, axis=-1)
    k, s = 1 - 2 * NU, r + z
    g = np.empty(points.shape + (3,))
    g[..., :2, :2] = (1 + k * r / s)[..., None, None] * np.eye(2)
    g[..., :2, :2] += x[..., :, None] * x[..., None, :] * (1 / r**2 - k / s**2)[..., None, None]
    g[..., 2, :2] = x * (z / r**2 + k / s)[..., None]
    g[..., :2, 2] = x * (z / r**2 - k / s)[..., None]
    g[..., 2, 2] = z**2 / r**2 + 2 * (1 - NU)
    return (1 + NU) / (2 * math.pi * E * r)[..., None, None] * g


def contact(centre, radius, force, torque):
    """Displacement [m] of the markers in a half-space under a round patch (2.5): force [N] spread as sqrt(1 - r^2/a^2),
    torque [N m] about +z as r times that."""
    node, weight = np.polynomial.legendre.leggauss(10)
    s = np.repeat((node + 1) / 2, 24)  # sqrt(1 - r^2/a^2), in which the integral over the radius is polynomial
    angle, r = np.tile(2 * math.pi * np.arange(24) / 24, 10), radius * np.sqrt(1 - s**2)
    share = np.repeat(weight, 24) * s**2
    share /= share.sum()
    place = np.stack([centre[0] + r * np.cos(angle), centre[1] + r * np.sin(angle), 0 * r], axis=1)
    turning = np.stack([-np.sin(angle), np.cos(angle), 0 * r], axis=1) * (r * share / (r**2 * share).sum())[:, None]
    return sum(influence(MARKERS - p) @ f for p, f in zip(place, share[:, None] * force + torque * turning))


def finite_elements(path, case):
    """Displacement [m] of the markers by 1 N on the block, from the reference [mm] at E = 0.018 MPa."""
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="ascii")
    table = np.sort(table[table["case"] == case], order=("layer", "y", "x"))
    return 1e-3 * 0.018e6 / E * np.stack([table[name] for name in ("ux", "uy", "uz")], axis=-1).reshape(MARKERS.shape)


# Projection (2.2, 2.3).

@dataclasses.dataclass(frozen=True)
class Camera:
    position_mm: tuple = (0.0, 0.0, 157.0)
    rotation_rad: tuple = (0.0, 0.0, 0.0)
    focal_px: float = 960.0
    aspect: float = 1.0
    principal_px: tuple = (319.5, 239.5)
    k1: float = 0.0
    k2: float = 0.0
    gel_index: float = 1.0
    window_index: float = 1.0
    window_thickness_mm: float = 0.0

    def gel_file(self):
        """What a gel file must say of this camera; the rest is default."""
        values = {key: list(value) if isinstance(value, tuple) else value for key, value in vars(self).items()}
        return "format = 1\n[camera]\n" + "".join(f"{key} = {value}\n" for key, value in values.items())

    def project(self, points):
        """(u, v) [px] of gel points (..., 3)."""
        position, window = 1e-3 * np.array(self.position_mm), 1e-3 * self.window_thickness_mm
        d = points[..., :2] - position[:2]
        distance = np.maximum(np.linalg.norm(d, axis=-1), 1e-12)
        layers = [(THICKNESS - points[..., 2], self.gel_index), (window, self.window_index),
                  (position[2] - THICKNESS - window, 1.0)]
        tangent = distance / sum(thickness / index for thickness, index in layers)  # of the ray's angle in air
        for _ in range(40):  # Snell: the layers' sideways shifts add up to the distance
            sine = [tangent / np.hypot(1, tangent) / index for _, index in layers]
            tangent = tangent * distance / sum(a * s / np.sqrt(1 - s**2) for (a, _), s in zip(layers, sine))
        ray = np.concatenate([(tangent / distance)[..., None] * d, -np.ones(d.shape[:-1] + (1,))], axis=-1)
        x, y, z = self.rotation_rad
        turn = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = np.linalg.matrix_power(np.eye(3) + turn / 2**26, 2**26)  # the exponential
        ray = ray @ np.diag([1, -1, -1]) @ turn.T
        ab = ray[..., :2] / ray[..., 2:]
        r2 = (ab**2).sum(axis=-1, keepdims=True)
        focal = np.array([self.focal_px, self.aspect * self.focal_px])
        return self.principal_px + focal * (1 + self.k1 * r2 + self.k2 * r2**2) * ab


# Picture (2.4).

_AT = np.linspace(-12, 12, 24001)
_NORMAL = np.array([(1 + math.erf(x / math.sqrt(2))) / 2 for x in _AT])


def cover(centres, radius, columns, rows, chords=24, aspect=1.0):
    """Blurred discs averaged over pixels, (disc, row, column), cut into chords; `columns`, `rows`: (disc, n).

    They are ellipses of the discs' area that are `aspect` times as high as wide.
    """
    angle, pixel = math.pi * (np.arange(chords) + 0.5) / chords, 0.5 / BLUR_PX
    place, half = (radius / BLUR_PX * wave(angle)[:, None] * stretch
                   for wave, stretch in ((np.cos, aspect**0.5), (np.sin, aspect**-0.5)))
    u, v = (((grid - centres[:, i:i + 1]) / BLUR_PX)[:, None] for i, grid in enumerate((columns, rows)))

    def once(x):  # the normal density's integral from -infinity, and that function's
        return np.interp(x, _AT, _NORMAL)

    def twice(x):
        return x * once(x) + np.exp(-x**2 / 2) / math.sqrt(2 * math.pi)

    across = once(v - place + pixel) - once(v - place - pixel)
    along = twice(u + half + pixel) - twice(u - half + pixel) - twice(u + half - pixel) + twice(u - half - pixel)
    return BLUR_PX**2 * math.pi / chords * np.einsum("k,mkv,mku->mvu", aspect * half[:, 0], across, along)


def picture(camera, pixels):
    """Levels before noise, (v, u, red green blue), of markers at `pixels` (layer, marker, 2), of which none overlap."""
    levels = np.full(SHAPE + (3,), BACKGROUND)
    step = 1e-6 * np.eye(3)[:2]
    for layer in (0, 1):
        jacobian = (camera.project(LAYER_CENTRE[layer] + step) - camera.project(LAYER_CENTRE[layer] - step)) / 2e-6
        columns, rows = np.moveaxis(np.rint(pixels[layer]).astype(int)[..., None] + np.arange(-7, 8), 1, 0)
        part = cover(pixels[layer], DIAMETER / 2 * math.sqrt(abs(np.linalg.det(jacobian))), columns, rows,
                     aspect=camera.aspect)
        weight = CONTRAST * np.array([[CROSS_TALK, CROSS_TALK, 1], [1, CROSS_TALK, CROSS_TALK]][layer])
        np.add.at(levels, (rows[:, :, None], columns[:, None]), part[..., None] * weight)
    return levels


def frame(levels, pixel_format, noise):
    """Raw bytes, RGB8 or BayerGR8, with read noise drawn from the generator `noise`."""
    if pixel_format == "BayerGR8":
        channel = np.tile([[1, 0], [2, 1]], (SHAPE[0] // 2, SHAPE[1] // 2))
        levels = np.take_along_axis(levels, channel[..., None], axis=2)
    levels = levels + READ_NOISE * noise.standard_normal(levels.shape, dtype=np.float32)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8).tobytes()
