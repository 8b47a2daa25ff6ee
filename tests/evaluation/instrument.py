"""The instrument itself: marker centres, calibration. Each takes the report and whether
to be quick, like the experiments.
"""

import numpy as np

import chain
import truth
from chain import GF
from report import rms


def marker_level(sigma_noise, radius_px=1.92, blur_px=0.8, contrast=100.0):
    """Cramer-Rao bound of a coordinate of a lone marker's centre [px], from its own channel, with unknown contrast and
    background: mean over the places of its centre in a pixel."""
    fine = 8
    size = 15
    bounds = []
    for phase in np.linspace(0, 0.5, 4):
        at = (np.arange(size * fine) + 0.5) / fine - size / 2 - phase
        x, y = np.meshgrid(at, (np.arange(size * fine) + 0.5) / fine - size / 2)
        spectrum = np.fft.rfft2((x * x + y * y <= radius_px**2).astype(float))
        fy, fx = np.meshgrid(
            np.fft.fftfreq(size * fine, 1 / fine), np.fft.rfftfreq(size * fine, 1 / fine), indexing="ij"
        )
        blurred = np.fft.irfft2(spectrum * np.exp(-2 * (np.pi * blur_px) ** 2 * (fx**2 + fy**2)), s=x.shape)
        level = blurred.reshape(size, fine, size, fine).mean((1, 3))
        slope = [
            np.gradient(blurred, 1 / fine, axis=axis).reshape(size, fine, size, fine).mean((1, 3)) for axis in (1, 0)
        ]
        columns = np.stack([contrast * slope[0], contrast * slope[1], level, np.ones_like(level)], -1).reshape(-1, 4)
        bounds.append(np.sqrt(np.linalg.inv(columns.T @ columns)[0, 0]) * sigma_noise)
    return float(np.mean(bounds))


def centres(report, quick):
    report.section(
        "Marker centres",
        """
        The markers of the unloaded gel, the picture shifted by parts of a pixel. The bound is Cramér and Rao's for a
        lone marker with unknown contrast and background, in its own colour alone.""",
    )
    places, frames = 12, (20 if quick else 60)
    generator = np.random.default_rng(20055)
    shift = generator.uniform(-0.5, 0.5, (places, 2))
    stray = np.zeros((places * frames, 5))
    stray[:, :2] = np.repeat(shift, frames, axis=0)
    stray[:, 4] = 1
    found = chain.run(np.zeros((places * frames, 1152, 3)), picture=stray)
    error = (found.marker_px - found.true_px).reshape(places, frames, 1152, 2)
    valid = found.marker_valid.reshape(places, frames, 1152).all((0, 1))
    error = error[:, :, valid]
    random = rms(error - error.mean(1, keepdims=True)) * np.sqrt(frames / (frames - 1))
    # What is left of the mean is noise of the frames and of the zero; what is common to the places is the zero's.
    mean = error.mean(1)
    mean = mean - mean.mean(0)
    systematic = np.sqrt(max(0.0, rms(mean) ** 2 * places / (places - 1) - random**2 / frames))
    bound = marker_level(2.0)
    report.row("marker centre: information limit", f"{bound:.4f} px")
    report.row(
        "    random error over it", f"{random:.4f} px, {random / bound:.2f}", "<= 1.3", random / bound, paper="0.1 px", must=True
    )
    report.row("    systematic part", f"{systematic:.4f} px", "<= 0.005 px", systematic, must=True)
    stated = np.sqrt(found.marker_variance_px2.reshape(places, frames, 1152)[:, :, valid].mean())
    report.row("    stated deviation over the real one", f"{stated / random:.2f}")


def calibration(report, quick):
    report.section(
        "Calibration with weights alone",
        """
        A camera, a lens and a Young's modulus that differ from the gel file's: geometry from the rest pattern, noise
        from rest frames, E from weights of 100, 200 and 500 gf standing near the centre, all by the daemon's own
        calibration from drawn pictures. The weights' displacements are CalculiX's. Root mean squares over the sensors,
        each of its own camera and E.""",
    )
    generator = np.random.default_rng(20057)
    weights_gf = np.array([100, 200, 500])
    sensors = 1 if quick else 6
    press = truth.load(40, 0.49, "places").displacement[2]
    hidden, found, stated, residual = [], [], [], []
    names = ["youngs_modulus_pa", "focal_px", *[f"position_{axis}_mm" for axis in "xyz"]]
    names += [f"rotation_{axis}_rad" for axis in "xyz"]
    for seed in range(sensors):
        young = chain.YOUNG * np.exp(generator.uniform(-0.2, 0.2))
        position = [0, 0, 157] + [1.2, 0.8, 1] * generator.uniform(-1, 1, 3)
        rotation = 0.01 * generator.uniform(-1, 1, 3)
        focal = 960 * (1 + 0.002 * generator.standard_normal())
        figures = chain.calibrate(
            weights_gf[:, None, None] * GF * press * chain.YOUNG / young,
            chain.gel_text(),
            chain.gel_text(young=young, position=position, rotation=rotation, focal=focal),
            weights_gf * GF,
            seed + 1,
        )
        hidden.append([young, focal, *position, *rotation])
        found.append([figures[name][0] for name in names])
        stated.append([figures[name][1] for name in names])
        residual.append(figures["residual_px"][0])
    error, stated = np.array(found) - hidden, np.array(stated)
    young = rms(error[:, 0] / np.array(hidden)[:, 0])
    report.row(
        f"weights-only calibration: error of hidden E (cameras: {sensors})", f"{100 * young:.2f} %", "<= 1 %", young, must=True
    )
    report.row("    residual of the rest pattern", f"{rms(residual):.4f} px")
    scales = [100 / chain.YOUNG, 1, 1, 1, 1, 1e3, 1e3, 1e3]
    units = ["E [%]", "focal length [px]", *[f"{axis} [mm]" for axis in "xyz"], *[f"about {a} [mrad]" for a in "xyz"]]
    report.table(
        ["figure", "error", "stated deviation"],
        [
            (unit, f"{scale * rms(error[:, i]):.3f}", f"{scale * rms(stated[:, i]):.3f}")
            for i, (unit, scale) in enumerate(zip(units, scales))
        ],
    )
