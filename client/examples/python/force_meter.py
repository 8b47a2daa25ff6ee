"""A force meter: the resultant and what is known of it, ten times a second. usage: force_meter.py [ENDPOINT]"""

import sys
import time

import traction


def reading(field: traction.Field) -> str:
    doubt = field.header.flags & ~(traction.Flag.ZERO_UNVERIFIED | traction.Flag.GEL_UNVERIFIED).value
    doubts = f"   ! {doubt.name}" if doubt else ""
    if not field.valid:
        return f"no force{doubts}"
    numbers = zip("xyz", field.resultant_N, field.resultant_covariance_N2.deviation)
    return "   ".join(f"{axis} {force:+z7.3f} ± {2 * deviation:.3f} N" for axis, force, deviation in numbers) + doubts


def main() -> None:
    endpoint = sys.argv[1] if len(sys.argv) > 1 else ""
    for field in traction.fields(endpoint=endpoint, mode=traction.Mode.LATEST):
        print(reading(field), flush=True)
        time.sleep(0.1)


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, BrokenPipeError):
        pass
    except traction.Error as error:
        sys.exit(f"force_meter: {error}")
