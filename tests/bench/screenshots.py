"""What tools/screenshots does: pictures of traction-view's page, of each view, load and theme, on a screen and on a phone."""

import pathlib
import re
import sys
import time

import rig
from browser import Browser, start_view

SCREEN, PHONE = (1400, 900), (390, 844)
SETTLED_S = 2.5  # until cameras and scales have settled


def contact(x, y, normal, radius=5, shear=(0, 0), torque=0):
    """Of a scenario; held for ever."""
    held = lambda value: [0, float(value)]  # noqa: E731
    return (f'[[contacts]]\nshape = "hertz"\nradius_mm = {radius}\ntime_s = [4, 5]\nx_mm = {x}\ny_mm = {y}\n'
            f"force_x_n = {held(shear[0])}\nforce_y_n = {held(shear[1])}\nforce_z_n = {held(normal)}\ntorque_n_mm = {held(torque)}\n")


LOADS = {
    "rest": "",
    "press": contact(0.7, 0.4, 4),
    "four": contact(-16, 12, 3, shear=(0.8, 0.3)) + contact(14, 15, 2, radius=3.5) + contact(12, -13, 3, torque=7) +
            contact(-12, -14, 2.5, radius=4, shear=(-0.3, -0.7)),
}


def shoot(folder, load, text):
    with rig.Rig() as bench:
        scenario = bench.folder / "load.toml"
        scenario.write_text("format = 1\nperiod_s = 1000000\n" + text)
        bench.twin(scenario)
        bench.daemon("[solve]\npatience_ms = 1000\n")  # a late field is better than none where all share two processors
        session = bench.folder / "session"
        (session / "tractiond").mkdir(parents=True)
        (session / "tractiond" / "default").symlink_to(bench.folder / "default" / "run")
        session = {"XDG_RUNTIME_DIR": str(session)}
        bench.start(rig.BIN / "traction-touch", env=session)
        browser = Browser(bench, start_view(bench, None, "--instance", "default", env=session).url, *SCREEN)
        browser.wait_for(f"window.traction?.model?.tracked?.length === {text.count('[[contacts]]')} && traction.model.preview")
        newtons = sum(map(float, re.findall(r"force_z_n = \[0, ([\d.]+)\]", text)))
        browser.wait_for(f"traction.model.surface_share === 1 && traction.model.field.resultant_N[2] >= {0.9 * newtons}")
        for theme in ("light", "dark"):
            if browser.evaluate("document.documentElement.classList.contains('light')") != (theme == "light"):
                browser.ask(key="d")
            for size, device in ((SCREEN, "screen"), (PHONE, "phone")):
                browser.ask(size=size)
                time.sleep(SETTLED_S)
                browser.ask(picture=str(folder / f"{load}-{theme}-{device}.png"))
            browser.ask(size=SCREEN)
            for key, view in zip("1234", "abcd"):
                browser.ask(key=key)
                time.sleep(SETTLED_S)
                browser.ask(picture=str(folder / f"{load}-{theme}-{view}.png"))
            browser.ask(key="0")


def main():
    folder = pathlib.Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for load, text in LOADS.items():
        shoot(folder, load, text)
        print(f"{load}: {len(list(folder.glob(f'{load}-*.png')))} pictures in {folder}", flush=True)


if __name__ == "__main__":
    main()
