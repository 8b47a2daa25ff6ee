"""Runs evaluation_chain on displacements and reads what it found."""

import contextlib
import hashlib
import json
import os
import pathlib
import subprocess
import tempfile

import numpy as np

BUILD = pathlib.Path(os.environ["TRACTION_BUILD"])
GF = 9.80665e-3  # newtons in a gram force
YOUNG = 0.18e6  # Pa, of the true displacements

GEL = """format = 1
[gel]
youngs_modulus_pa = {young}
poisson_ratio = {poisson}
thickness_mm = {thickness}
[[layers]]
colour = "blue"
depth_mm = 6
[[layers]]
colour = "red"
depth_mm = {red_depth}
centre_mm = [1.5, 1.5]
[camera]
focal_px = {focal}
position_mm = {position}
rotation_rad = {rotation}
"""


def gel_text(
    thickness=40, poisson=0.49, young=YOUNG, red_depth=8, position=(0, 0, 157), rotation=(0, 0, 0), focal=960.0
):
    return GEL.format(
        young=young,
        poisson=poisson,
        thickness=thickness,
        red_depth=red_depth,
        focal=focal,
        position=list(map(float, position)),
        rotation=list(map(float, rotation)),
    )


def one_layer_text(depth, centre_mm):
    """The paper's gel with one layer, of black dots."""
    text = gel_text()
    text = text[: text.index('[[layers]]\ncolour = "red"')] + text[text.index("[camera]") :]
    return text.replace('colour = "blue"', 'colour = "grey"\ncontrast = "darker"').replace(
        "depth_mm = 6", f"depth_mm = {depth}\ncentre_mm = [{centre_mm}, {centre_mm}]"
    )


class Found(dict):
    """Arrays by name, a row a frame."""

    __getattr__ = dict.__getitem__

    @property
    def wrench(self):
        """Force and moment, frames x 6 [N, N m]."""
        return np.hstack([self["resultant_N"], self["moment_Nm"]])

    @property
    def deviation(self):
        """Stated of them, in all."""
        covariance = (self["noise_covariance"] + self["systematic_covariance"]).reshape(-1, 6, 6)
        return np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0))

    @property
    def contacts_found(self):
        """For each frame a C x 12 array: position 2, deviation 2, force 3, deviation 3, area, deviation."""
        table = self["contacts"].reshape(len(self["contacts"]), -1, 12)
        return [table[frame, : int(count)] for frame, count in enumerate(self["contact_count"][:, 0])]


def state_directory(*texts):
    """Where the factors for these texts are kept; of its own, because the daemon keeps the newest four. May be deleted."""
    path = BUILD / "evaluation-state" / hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]
    path.mkdir(parents=True, exist_ok=True)
    return path


@contextlib.contextmanager
def job(**contents):
    """A folder with these files: texts; arrays of numbers, NAME.f64, or of bool, NAME.u8."""
    with tempfile.TemporaryDirectory(prefix="evaluation-") as name:
        folder = pathlib.Path(name)
        for name, content in contents.items():
            if isinstance(content, str):
                (folder / name).write_text(content)
            elif np.asarray(content).dtype == bool:
                np.ascontiguousarray(content).tofile(folder / f"{name}.u8")
            else:
                np.ascontiguousarray(content, float).tofile(folder / f"{name}.f64")
        yield folder


def call(program, *words):
    """Runs one of the evaluation's programs. Returns what it printed."""
    command = [str(word) for word in (BUILD / "bin" / f"evaluation_{program}", *words)]
    ran = subprocess.run(command, capture_output=True, text=True, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    if ran.returncode:
        raise RuntimeError(f"{' '.join(command)}: {ran.stderr}")
    return ran.stdout


def run(displacement, gel=None, twin_gel=None, solve="", state=None, **given):
    """displacement: frames x markers x 3 [m]. `gel`, `twin_gel`: texts of gel files, what the daemon believes and what
    the camera sees. `solve`: lines of the configuration's [solve]. `state`: where factors are kept. Arrays:
    `missing`, frames x markers, whether it is not drawn; `picture`, frames x 5, how the picture strays: shift u, v [px],
    scale - 1, roll [rad], brightness; `scatter`, markers x 3 [m], how far the gel's markers sit from the gel file's
    places; `highlight`, frames x 4, centre u, v [px], radius [px], strength [levels]; `time`, frames, when each is taken
    [s], for gels that creep and heat; `amount`, frames x patterns, so much of each pattern of `displacement` a frame
    shows. Others: the program's options; one that is True is a flag.
    """
    gel = gel or gel_text()
    texts = {"gel": gel, "twin-gel": twin_gel, "config": solve and f"[solve]\n{solve}\n"}
    texts = {name: text for name, text in texts.items() if text}
    arrays = {name: value for name, value in given.items() if isinstance(value, np.ndarray)}
    options = ["--state", state or state_directory(gel, solve)]
    for key, value in given.items():
        if key not in arrays and value is not None:
            options += ["--" + key.replace("_", "-")] + ([] if value is True else [value])
    with job(displacement=displacement, **texts, **arrays) as folder:
        call("chain", folder, *options, *(word for name in texts for word in (f"--{name}", folder / name)))
        found = Found()
        for line in (folder / "columns").read_text().splitlines():
            column, width = line.split()
            found[column] = np.fromfile(folder / f"{column}.f64").reshape(-1, int(width))
        return found


def calibrate_creep(press, amounts, times_s, held_s, seed, pictures):
    """The tables [[creep]] that the daemon's calibration writes, for a load that displaces the markers by these amounts
    of a press (markers x 3 [m]) at these times."""
    with job(displacement=press, amount=amounts, time=times_s, gel=gel_text()) as folder:
        gel, how = folder / "gel", [] if pictures else ["--given", 0.03]
        call("calibrate", folder, "--gel", gel, "--twin-gel", gel, "--creep", held_s, "--seed", seed, *how)
        (path,) = folder.glob("gel-*.toml")
        return "".join(path.read_text().partition("[[creep]]")[1:])


def mechanics(gel, forces, markers=1152):
    """Displacements by the project's own block [m], loads x markers x 3. `forces`: rows of load, x, y, force."""
    with job(forces=forces, gel=gel) as folder:
        call("parts", "mechanics", folder, folder / "gel")
        return np.fromfile(folder / "displacement.f64").reshape(-1, markers, 3)


def surface(gel, forces):
    """How the touched surface moves at the nodes under even forces on their squares [m], frames x nodes x 3. `forces`: the
    same [N]."""
    with job(force=forces, gel=gel) as folder:
        call("parts", "surface", folder, folder / "gel")
        return np.fromfile(folder / "surface.f64").reshape(np.shape(forces))


def under_rounds(found, moved, gel, nodes, places):
    """What the viewer's page makes of that where contacts are round: how the nodes move inwards without these contacts,
    frames x nodes, and what the contacts add at places (2 x P [m]), frames x P [m]. `gel`: modulus [Pa], Poisson's ratio."""
    frames = []
    for contacts, radii, one in zip(found.contacts_found, found.radii.reshape(len(moved), -1, 2), moved):
        listed = [
            {"position_m": row[:2], "position_deviation_m": row[2:4], "force_N": row[4:7], "force_deviation_N": row[7:10],
             "moment_Nm": [0, 0, 0], "hertz_radius_m": radius, "hertz_radius_deviation_m": deviation}
            for row, (radius, deviation) in zip(contacts.tolist(), radii.tolist())
        ]
        frames.append({"contacts": listed, "displacement_mm": (1e3 * one).ravel().tolist()})
    columns, rows, pitch_m = nodes
    description = {
        "nodes": {"pitch_m": pitch_m, "centre_m": [0, 0]},
        "gel": {"youngs_modulus_Pa": gel[0], "poisson_ratio": gel[1]},
    }
    job = {"columns": columns, "rows": rows, "description": description, "places_mm": (1e3 * places.T).tolist(), "frames": frames}
    script = pathlib.Path(__file__).with_name("surface.mjs")
    answer = subprocess.run(["node", script], input=json.dumps(job), capture_output=True, text=True, check=True).stdout
    return tuple(1e-3 * np.array([frame[name] for frame in json.loads(answer)]) for name in ("beside", "under"))


def calibrate(displacement, gel, twin_gel, weights_N, seed):
    """Of each figure, value and deviation. displacement: weights x markers x 3 [m]; of figures of the same name, the
    first one's."""
    with job(displacement=displacement, gel=gel, **{"twin-gel": twin_gel}) as folder:
        weights = ",".join(map(repr, map(float, weights_N)))
        gels = ["--gel", folder / "gel", "--twin-gel", folder / "twin-gel"]
        call("calibrate", folder, *gels, "--weights", weights, "--seed", seed)
        lines = [line.split() for line in (folder / "figures").read_text().splitlines()]
        return {words[1]: (float(words[2]), float(words[3])) for words in reversed(lines)}
