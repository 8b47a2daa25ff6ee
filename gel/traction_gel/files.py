"""The input file, and what is written: influence file, gel file, picture."""

import contextlib
import math
import os
import pathlib
import tomllib

import numpy as np

from .picture import draw
from .placement import LEAST_PERCENT
from .problem import Problem
from .shapes import refracting_surfaces

CAMERA = {"width_px": 640, "height_px": 480, "focal_px": 960, "principal_px": [319.5, 239.5], "position_mm": [0, 0, 157]}
SILICONE = [{"share": 0.015, "time_s": time_s, "deviation": 0.01} for time_s in (2, 20)]  # creep that nobody has measured
MOULD = {"wall_mm": 4, "pin_mm": 3, "clearance_mm": 0.1, "lid_mm": 4, "bridge_mm": 4}
LEAST_MARKERS = 4  # columns and rows of a layer that tractiond can follow
LISTS = {"layers": "layer", "creep": "term", "materials": "material"}
KEYS = {
    "": {"format", "error_percent", "shape", "material", "layers", "nodes", "camera", "uncertainty", "picture_motion",
         "creep", "deviations", "materials", "mould", "bone"},
    "shape": {"kind", "gel_file", "bone_file", "bonded_box_mm", "bonded_percent", "cavities", "diameter_mm", "length_mm", "gel_mm", "width_mm",
              "height_mm", "thickness_mm"},
    "material": {"youngs_modulus_pa", "poisson_ratio"},
    "materials": {"youngs_modulus_pa", "poisson_ratio", "skin_mm", "gel_file"},
    "layers": {"colour", "contrast", "columns", "rows", "pitch_mm", "centre_mm", "depth_mm", "diameter_mm", "scatter_mm",
               "positions_mm", "any_order", "least_mm", "seed"},
    "nodes": {"columns", "rows", "pitch_mm", "centre_mm"},
    "deviations": {"bone_mm", "youngs_modulus_relative"},
    "mould": {*MOULD, "pour_mm"},
    "bone": {"index", "gel_index", "wall_mm"},
}  # fmt: skip


def read(path):
    """Reads and checks an input file. Camera, uncertainty and picture motion are passed on: tractiond checks them."""
    try:
        text = pathlib.Path(path).read_bytes()
        if b"\0" in text:
            raise Problem(f'{path} has bytes that are 0, as in UTF-16 ("Unicode" in old Notepads): save it as UTF-8')
        task = tomllib.loads(text.decode("utf-8-sig"))
    except OSError as error:
        raise Problem(f"{path} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise Problem(f"{path} is no TOML: {error}") from None
    if task.get("format") != 1:
        raise Problem(f"{path}: format is {task.get('format')!r}: this program knows format = 1")
    for name in ("shape", "material", "layers", "nodes"):
        if not task.get(name):
            raise Problem(f"{path}: [{name}] is missing")
    for name, table in task.items():
        tables = table if name in LISTS and isinstance(table, list) else [table]
        if name not in ("format", "error_percent") and not all(isinstance(each, dict) for each in tables):
            raise Problem(f"{path}: {name} is no table: write [{name}], and [[layers]] for each layer")
    for name in LISTS:
        if isinstance(task.get(name), dict):
            raise Problem(f"{path}: write [[{name}]], for each {LISTS[name]}, and not [{name}]")
    for name, known in KEYS.items():
        for table in [task] if not name else task.get(name, []) if name in LISTS else [task.get(name, {})]:
            for key in table.keys() - known:
                raise Problem(f"{path}: {name + '.' if name else ''}{key} is unknown: one of {', '.join(sorted(known))}")
    task["camera"] = CAMERA | task.get("camera", {})
    task["error_percent"] = _number(task, "", "error_percent", 0.01, 50, 1)
    others = task.get("materials", [])
    for name, table in [("material.", task["material"])] + [(f"materials[{k}].", each) for k, each in enumerate(others)]:
        _number(table, name, "youngs_modulus_pa", 100, 1e9)
        if _number(table, name, "poisson_ratio", 0, 0.5) > 0.4999:
            raise Problem(f"{name}poisson_ratio is above 0.4999: 0.5 is incompressible, silicone has 0.49 to 0.499")
        if "skin_mm" in table:
            _number(table, name, "skin_mm", 0.02, 100)
    for name, table in [("nodes.", task["nodes"])] + [(f"layers[{k}].", layer) for k, layer in enumerate(task["layers"])]:
        for key in ("columns", "rows"):
            _number(table, name, key, 1 if name == "nodes." else LEAST_MARKERS, 1000)
        _list(table, name, "centre_mm", (2,))
        if name == "nodes." or "positions_mm" not in table:
            _number(table, name, "pitch_mm", 0.05, 100)
        if name != "nodes.":
            _number(table, name, "diameter_mm", 0.01, 100)
            _number(table, name, "scatter_mm", 0, 100, 0)
            _number(table, name, "least_mm", 0, 100, 0)
            _number(table, name, "seed", 0, 2**53, 0)
            if not isinstance(table.get("any_order", False), bool):
                raise Problem(f"{name}any_order is {table['any_order']!r}: it must be true or false")
            _list(table, name, "positions_mm", (table["columns"] * table["rows"], 3))
            if "positions_mm" not in table:
                _number(table, name, "depth_mm", 0.05, 1000)
    for name, table in [("shape.", task["shape"])] + [(f"materials[{k}].", each) for k, each in enumerate(others)]:
        for key in table.keys() & {"kind", "gel_file", "bone_file"}:
            if not isinstance(table[key], str):
                raise Problem(f"{name}{key} is {table[key]!r}: it must be a name, in quotes")
    _list(task["shape"], "shape.", "bonded_box_mm", (2, 3))
    _number(task["shape"], "shape.", "bonded_percent", 0, 100, LEAST_PERCENT)
    _number(task["shape"], "shape.", "cavities", 0, 1000, 0)
    _list(task.get("deviations", {}), "deviations.", "bone_mm", (3,))
    _list(task.get("deviations", {}), "deviations.", "youngs_modulus_relative", (len(others),))
    task["mould"] = MOULD | task.get("mould", {})
    for key in task["mould"]:
        _number(task["mould"], "mould.", key, 0.02, 100)
    if "bone" in task:
        _bone(task)
    for key, value in CAMERA.items():
        if isinstance(value, list):
            _list(task["camera"], "camera.", key, (len(value),))
        else:
            _number(task["camera"], "camera.", key, 1, 1e6)
    return task


def _bone(task):
    """Writes into [camera] how the bone refracts."""
    for key in ("index", "gel_index"):
        _number(task["bone"], "bone.", key, 1, 3)
    if "wall_mm" in task["bone"]:
        _number(task["bone"], "bone.", "wall_mm", 0.02, 100)
    for key in ("gel_index", "surfaces"):
        if key in task["camera"]:
            raise Problem(f"camera.{key} does not go with [bone], which says it")
    task["camera"] |= {"gel_index": task["bone"]["gel_index"], "surfaces": refracting_surfaces(task)}


def _list(table, name, key, shape):
    """Raises a Problem if the key is there and holds no numbers of this shape."""
    try:
        right = key not in table or np.shape(np.array(table[key], float)) == shape
    except (TypeError, ValueError):
        right = False
    if not right:
        raise Problem(f"{name}{key} must hold {' x '.join(map(str, shape))} numbers, in brackets")


def _number(table, name, key, least, most, default=None):
    value = table.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value <= most:
        raise Problem(f"{name}{key} is {value!r}: it must be a number from {least:g} to {most:g}")
    if key in ("columns", "rows", "seed", "cavities") and value != math.floor(value):
        raise Problem(f"{name}{key} is {value!r}: it must be a whole number")
    return value


def _toml(value):
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return repr(value if isinstance(value, int) else float(value))  # NumPy 2 writes its own numbers with their type


def gel_text(task, result, influence_name):
    """Returns the gel file that names the influence file."""
    gel = {"influence_file": influence_name, "thickness_mm": round(result.thickness, 3)}
    layers = [{key: layer[key] for key in ("colour", "contrast", "columns", "rows", "diameter_mm") if key in layer}
              for layer in task["layers"]]  # fmt: skip
    uncertainty = {"model_relative": round(max(result.error_percent / 100, 0.003), 4)} | task.get("uncertainty", {})
    tables = [("[gel]", gel)] + [("[[layers]]", {"colour": "grey"} | layer) for layer in layers]
    tables += [("[nodes]", {key: task["nodes"][key] for key in ("columns", "rows")}), ("[camera]", task["camera"])]
    tables += [("[uncertainty]", uncertainty)]
    if "picture_motion" in task:
        tables.append(("[picture_motion]", task["picture_motion"]))
    tables += [("[[creep]]", term) for term in task.get("creep", SILICONE)]
    text = "# Made by traction-gel; change its input file, not this one.\n\nformat = 1\n"
    for head, table in tables:
        text += f"\n{head}\n" + "".join(f"{key} = {_toml(value)}\n" for key, value in table.items())
    return text


@contextlib.contextmanager
def replaced(*paths):
    """Yields a temporary name beside each path. Renames all of them at the end, or removes them if something failed."""
    temporary = [path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}") for path in paths]
    try:
        yield temporary
        for name, path in zip(temporary, paths):
            os.replace(name, path)
    finally:
        for name in temporary:
            name.unlink(missing_ok=True)


def write(task, result, stem):
    """Writes STEM.npz, STEM_gel.toml and STEM.png. Returns their paths."""
    stem = pathlib.Path(stem)
    paths = [stem.with_name(stem.name + end) for end in (".npz", "_gel.toml", ".png")]
    with replaced(*paths) as (influence, gel, picture):
        np.savez(
            influence,
            format="traction-influence/1",
            units="SI",
            youngs_modulus=float(task["material"]["youngs_modulus_pa"]),
            influence=result.influence.astype(np.float32),
            **({"influence_errors": result.errors.astype(np.float32)} if len(result.errors) else {}),
            node_positions=1e-3 * result.nodes,
            node_normals=result.normals,
            node_areas=1e-6 * result.areas,
            marker_positions=1e-3 * result.markers,
        )
        gel.write_text(gel_text(task, result, paths[0].name))
        draw(result, picture)
    return paths
