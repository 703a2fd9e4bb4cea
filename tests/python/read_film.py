"""Reads films with Pillow, and prints their frames as JSON: size, number, durations in ms, and the color at a place.

    read_film.py X Y FILE...
"""

import json
import sys

from PIL import Image, ImageSequence

x, y = int(sys.argv[1]), int(sys.argv[2])
films = {}
for path in sys.argv[3:]:
    with Image.open(path) as film:
        frames = [frame.convert("RGB") for frame in ImageSequence.Iterator(film)]
        durations = []
        for number in range(film.n_frames):
            film.seek(number)
            # The duration of a WebP frame is known after decoding.
            film.load()
            durations.append(film.info["duration"])
        films[path] = {
            "size": film.size,
            "frames": len(frames),
            "durations": durations,
            "first": frames[0].getpixel((x, y)),
        }
print(json.dumps(films))
