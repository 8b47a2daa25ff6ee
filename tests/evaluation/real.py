"""Pictures of gels that other people made: what the daemon finds in sets that a person has fetched into a folder.

Each folder in it is a set: gel.toml; set.toml with `source` (where the pictures are from), and optionally `noise_levels`
(of the noise that is added, since stills have none; 1.2 by default) and `config`, more lines of the configuration; and pictures.csv, a line a picture, with these columns: `file`; `kind`,
rest or press; optionally `u_px`, `v_px` (the middle of what presses, by a label), `load` (newtons, or any number that
grows with the load) and `group` (loads are compared within one). The first picture at rest is the zero.
"""

import collections
import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import numpy as np
from report import SOURCE, rms

sys.path.insert(0, str(SOURCE / "client/python"))
from traction import Field, Flag, recording  # noqa: E402

ZERO, PRESSED, RELEASED, HZ = 60, 4, 2, 25  # pictures of the zero and its check, of each press and of the rest after it


def touched_m(camera, pixels):
    """The places of the touched surface that a camera without refraction sees there, N x 2, gel frame [m]."""
    size, focal = (camera[f"{side}_px"] for side in ("width", "height")), camera["focal_px"]
    middle = camera.get("principal_px", [(side - 1) / 2 for side in size])
    distorted = (np.asarray(pixels, float) - middle) / [focal, focal * camera.get("aspect", 1)]
    plain = distorted.copy()
    for _ in range(50):
        squared = (plain**2).sum(1, keepdims=True)
        plain = distorted / (1 + camera.get("k1", 0) * squared + camera.get("k2", 0) * squared**2)
    x, y, z = camera.get("rotation_rad", (0, 0, 0))
    angle, cross = np.linalg.norm([x, y, z]), np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * cross @ cross
    rays = np.c_[plain, np.ones(len(plain))] @ turn @ np.diag([1, -1, -1])
    at = np.array(camera["position_mm"])
    return 1e-3 * (at - at[2] / rays[:, 2:] * rays)[:, :2]


def fields_of(pictures, noise, gel, config):
    """The daemon's fields of these pictures with noise of so many levels, by the pictures' numbers from 0."""
    random, (height, width, _) = np.random.default_rng(1), pictures[0].shape
    with tempfile.TemporaryDirectory(prefix="real-") as name:
        folder = pathlib.Path(name)
        (folder / "tractiond.toml").write_text(
            f'[camera]\nwidth_px = {width}\nheight_px = {height}\npixel_format = "RGB8"\nframe_rate_hz = {HZ}\n'
            f'[sensor]\ngel_file = "{gel}"\n{config}'
        )
        command = [pathlib.Path(os.environ["TRACTION_BUILD"]) / "bin/tractiond", "--instance", "real", "--config", folder / "tractiond.toml"]
        command += ["--state", folder / "state", "--runtime", folder, "--images", "-", "--record", folder / "mcap"]
        daemon = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            for picture in pictures:
                noisy = np.clip(np.rint(picture + random.normal(0, noise, picture.shape)), 0, 255)
                daemon.stdin.write(noisy.astype(np.uint8).tobytes())
        except BrokenPipeError:
            pass  # it says why
        log, _ = daemon.communicate()
        if daemon.returncode or not (folder / "mcap").exists():
            raise RuntimeError(f"{gel}: tractiond: {log.decode()}")
        fields = (each.message for each in recording(folder / "mcap"))
        found = {field.header.camera_frame_id - 1: field for field in fields if isinstance(field, Field)}
    if not found:
        print(log.decode())
    return found


def one_set(page, folder):
    from PIL import Image

    about = tomllib.loads((folder / "set.toml").read_text())
    rows = list(csv.DictReader((folder / "pictures.csv").open()))
    pictures = {row["file"]: np.asarray(Image.open(folder / row["file"]).convert("RGB"), float) for row in rows}
    rests = [row["file"] for row in rows if row["kind"] == "rest"]
    presses = [row for row in rows if row["kind"] == "press"]
    camera = tomllib.loads((folder / "gel.toml").read_text())["camera"]
    shown = [(None, rests[0])] * ZERO + [(None, rest) for rest in rests for _ in range(PRESSED)]
    for row in presses:
        shown += [(row, row["file"])] * PRESSED + [(None, rests[0])] * RELEASED
    fields = fields_of([pictures[file] for _, file in shown], about.get("noise_levels", 1.2), folder / "gel.toml", about.get("config", ""))

    seen = [(row, fields[number]) for number, (row, _) in enumerate(shown) if number in fields]
    valid = [(row, field) for row, field in seen if field.valid]
    untouched = [field for row, field in valid if row is None]
    pressed = [(row, field) for row, field in valid if row is not None]
    name = f"{folder.name}:"
    page.row(f"{name} valid fields; markers at rest, pressed", f"{len(valid)} of {len(seen)}; " + ", ".join(
        f"{np.mean([field.valid_markers for field in some]):.1f}" if some else "–" for some in (untouched, [field for _, field in pressed])))
    touched = sum(bool(field.contacts) for field in untouched)
    page.row(f"{name} pictures at rest with a contact", f"{touched} of {len(untouched)}", "0", touched)
    page.row(f"{name} pressed pictures with one contact, several, none; out of range",
             ", ".join(str(sum(n(len(field.contacts)) for _, field in pressed)) for n in (lambda c: c == 1, lambda c: c > 1, lambda c: c == 0))
             + f"; {sum(Flag.OUT_OF_RANGE in field.header.flags for _, field in pressed)} of {len(pressed)}")
    labelled = [(row, field.contacts[0]) for row, field in pressed if row.get("u_px") and field.contacts]
    if labelled:
        truth = touched_m(camera, [(float(row["u_px"]), float(row["v_px"])) for row, _ in labelled])
        off = np.array([contact.position_m for _, contact in labelled]) - truth
        stated = np.array([contact.position_deviation_m for _, contact in labelled])
        inside = np.mean(np.abs(off) <= 2 * stated)
        away = 1e3 * rms(np.linalg.norm(off, axis=1))
        page.row(f"{name} labelled places: off, rms; mean; median deviation", f"{away:.2f} mm; {np.round(1e3 * off.mean(0), 2)}; "
                 f"{1e3 * np.median(stated):.2f}", "<= 0.7 mm", away)
        page.row(f"{name} coordinates within two deviations", f"{100 * inside:.0f} %", "90 - 98 %", inside, within=(0.9, 0.98))
    groups = collections.defaultdict(list)
    for row, field in pressed:
        if row.get("load"):
            groups[row.get("group", "")].append((float(row["load"]), field.resultant_N[2], np.linalg.norm(field.resultant_N)))
    several = [np.array(loads).T for loads in groups.values() if len({load for load, *_ in loads}) > 1]
    if several:
        rank = lambda values: np.unique(values, return_inverse=True)[1]
        order = [[np.corrcoef(rank(loads), rank(each))[0, 1] for each in (normal, whole)] for loads, normal, whole in several]
        page.row(f"{name} order of loads, rank correlation: normal force, its length", "{:.2f}, {:.2f}".format(*np.nanmean(order, 0)))


folder = None  # of the sets


def real(page, quick):
    page.seed, page.again = "fixed", "--quick " * quick + "--only real FOLDER"
    sets = sorted(path.parent for path in pathlib.Path(folder).resolve().glob("*/set.toml"))
    sources = "; ".join(f"{path.name}: {tomllib.loads((path / 'set.toml').read_text())['source']}" for path in sets)
    page.section(
        "Real gels",
        f"""Pictures that other people published, {PRESSED} of each press and {RELEASED} of the gel at rest after it, {HZ} a second, through
        `tractiond --images` with the default keys but for those of the camera. Their gels are described by what their authors state, and by guesses where they
        state nothing. Their licences do not allow keeping them here: {sources}. `tests/evaluation/real.py` describes the folder that is read.""",
    )
    for each in sets:
        one_set(page, each)
