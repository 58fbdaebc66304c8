# SPDX-License-Identifier: Apache-2.0
"""What makes an object and its surroundings look as they do, procedurally: albedo of a surface, light around it, print on a
table. Each draws only from the random generator that it is given."""
import numpy as np

LATTICE = 64


def value_noise(points, frequency, rng):
    """Smooth noise in [-1, 1] at points (n, 3): random values on a lattice, interpolated by smoothstep, periodic."""
    lattice = rng.uniform(-1, 1, (LATTICE,) * 3)
    place = points * frequency + rng.uniform(0, LATTICE, 3)
    cell = np.floor(place).astype(int)
    t = place - cell
    t = t * t * (3 - 2 * t)
    noise = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        weight = np.where(corner, t, 1 - t).prod(1)
        noise += weight * lattice[tuple(((cell + corner) % LATTICE).T)]
    return noise


def albedo(points, texture, rng):
    """Albedo of points (n, 3) on the unit object. none: 0.45; strong: 0.05 to 0.9; weak: 0.4 to 0.5, and about half of the
    surface plain."""
    if texture == 'none':
        return np.full(len(points), 0.45)
    noise = sum(0.7 ** k * value_noise(points, 4 * 2 ** k, rng) for k in range(4))
    noise = ((noise - noise.mean()) / (2 * noise.std())).clip(-1, 1)
    if texture == 'strong':
        return (0.45 + 0.3 * noise).clip(0.05, 0.9)
    patch = value_noise(points, 1.7, rng)
    return 0.45 + 0.05 * noise * ((patch - np.median(patch)) / 0.1).clip(0, 1)


# Lamps: azimuth from the first one, elevation, width, height, radiance, softness of the edge; angles in degrees.
LAMPS = {'overcast': [(0, 48, 50, 30, 1.2, 14)],
         'studio': [(0, 40, 60, 40, 3.2, 3), (115, 15, 36, 70, 2.0, 3), (220, 50, 40, 28, 3.0, 3), (290, 5, 22, 50, 1.5, 3),
                    (0, 84, 500, 10, 2.0, 3)],
         'indoor': [(0, 18, 52, 40, 2.6, 3), (75, 12, 26, 52, 1.8, 3), (190, 40, 14, 14, 7.0, 3), (265, 22, 34, 30, 1.6, 3),
                    (0, 82, 500, 14, 2.0, 5)]}


def ambient(light, up):
    """Radiance without the lamps of a direction whose sine of elevation is `up`."""
    if light == 'overcast':
        return np.where(up > 0, 0.6 + 0.9 * np.maximum(up, 0), 0.22 + 0.1 * up)
    return 0.06 + 0.03 * up if light == 'studio' else 0.10 + 0.05 * up


def environment(light, rng, rows=256):
    """Radiance (rows, 2 rows), float32, over latitude (row 0 is up, +y) and longitude; the lamps stand turned at random."""
    latitude = 90 - (np.arange(rows)[:, None] + 0.5) / rows * 180
    longitude = (np.arange(2 * rows)[None] + 0.5) / rows * 180 - 180
    radiance = np.repeat(ambient(light, np.sin(np.radians(latitude))), 2 * rows, 1)
    first = rng.uniform(0, 360)
    for azimuth, elevation, width, height, power, soft in LAMPS[light]:
        beside = np.abs((longitude - first - azimuth + 180) % 360 - 180) * np.cos(np.radians(elevation)) - width / 2
        above = np.abs(latitude - elevation) - height / 2
        radiance += power / (1 + np.exp((np.maximum(beside, above) / soft * 2).clip(-50, 50)))
    return radiance.astype(np.float32)


def draw_shape(cv2, print_, rng):
    """One disc, box, stroke or letter of random place, size (6 to 66 px, mostly small) and grey."""
    at = tuple(map(int, rng.integers(0, len(print_), 2)))
    size, grey, shape = int(6 + 60 * rng.random() ** 3), int(rng.integers(12, 218)), rng.integers(4)
    if shape == 0:
        cv2.circle(print_, at, size, grey, -1, cv2.LINE_AA)
    elif shape == 1:
        box = cv2.boxPoints((at, (2 * size, size + 4), float(rng.uniform(0, 180))))
        cv2.fillPoly(print_, [box.astype(np.int32)], grey, cv2.LINE_AA)
    elif shape == 2:
        end = tuple(int(q + rng.normal(0, 3 * size)) for q in at)
        cv2.line(print_, at, end, grey, int(rng.integers(2, 8)), cv2.LINE_AA)
    else:
        letter = chr(int(rng.integers(48, 123)))
        cv2.putText(print_, letter, at, int(rng.integers(0, 5)), size / 12, grey, 3, cv2.LINE_AA)


def table_print(rng, size=3072, shapes=2600):
    """Reflectance (size, size), 0.05 to 0.85, of a print that structure from motion finds many features on: shapes over
    noise of four scales. How letters look depends on OpenCV's version."""
    import cv2  # only a table needs it
    noise = sum(0.06 * cv2.resize(rng.uniform(-1, 1, (n, n)), (size, size), interpolation=cv2.INTER_CUBIC)
                for n in (12, 48, 192, 768))
    print_ = (255 * (noise + 0.42).clip(0, 1)).astype(np.uint8)
    for _ in range(shapes):
        draw_shape(cv2, print_, rng)
    return (cv2.GaussianBlur(print_, (0, 0), 0.8) / 255).clip(0.05, 0.85)
