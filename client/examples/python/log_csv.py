"""Logs every field as a line of CSV, and says what was lost. usage: log_csv.py [FILE.csv [ENDPOINT [COUNT]]]"""

import csv
import itertools
import sys

import traction

COLUMNS = ("time_s", "sequence", "boot", "flags", "valid", "x_N", "y_N", "z_N", "deviation_x_N", "deviation_y_N",
           "deviation_z_N", "moment_x_Nm", "moment_y_Nm", "moment_z_Nm", "contacts")


def row(field: traction.Field) -> list[object]:
    header = field.header
    return [f"{header.received_real_ns * 1e-9:.6f}", header.sequence, header.boot.hex(), int(header.flags), int(field.valid),
            *field.resultant_N, *field.resultant_covariance_N2.deviation, *field.moment_Nm, len(field.contacts)]


def main() -> None:
    name, endpoint, count = (*sys.argv[1:], *("", "", "")[len(sys.argv) - 1:])
    with (open(name, "w", newline="") if name else sys.stdout) as file, \
            traction.Subscriber(endpoint=endpoint, topics=traction.Topics.FIELD, timeout=5) as subscriber:
        lines, lost = csv.writer(file), 0
        lines.writerow(COLUMNS)
        for field in itertools.islice(subscriber, int(count) if count else None):
            lines.writerow(row(field))
            if subscriber.lost > lost:
                print(f"log_csv: {subscriber.lost - lost} fields lost on the way", file=sys.stderr)
                lost = subscriber.lost


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
    except (traction.Error, OSError) as error:
        sys.exit(f"log_csv: {error}")
