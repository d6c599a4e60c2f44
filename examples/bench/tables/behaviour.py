"""Tables of behaviour.md."""
from tables.common import count, number, plain, read, table, text


def figure(value):
    try:
        return f"{float(value):.4g}"
    except ValueError:
        return value


def milliseconds(value):
    return value if value == "crashed" else number(value)


plain("behaviour/behaviour", "behaviour/behaviour.csv", [
    ("scene", "scene", text), ("world", "world", text), ("figure", "figure", text),
    ("Bullet alone", "Bullet", figure), ("LazyCCD", "LazyCCD", figure), ("bound", "bound", text),
    ("pass-throughs: Bullet", "Bullet pass-throughs", text), ("LazyCCD", "LazyCCD pass-throughs", text),
    ("ms a simulated second: Bullet", "Bullet ms a second", milliseconds), ("LazyCCD", "LazyCCD ms a second", milliseconds)])

plain("behaviour/momentum", "behaviour/momentum.csv", [
    ("world", "world", text), ("kept momentum, %: Bullet", "Bullet kept %", text),
    ("corrected Bullet", "corrected Bullet kept %", text), ("LazyCCD", "LazyCCD kept %", text),
    ("kinetic energy, J: Bullet", "Bullet J", text), ("corrected Bullet", "corrected Bullet J", text),
    ("LazyCCD", "LazyCCD J", text)])


PAIRS = {"Bullet faster": "Bullet, 0.1 % faster", "Bullet half step": "Bullet, half the step",
         "LazyCCD faster": "LazyCCD, 0.1 % faster", "LazyCCD": "LazyCCD against Bullet",
         "LazyCCD, Bullet mended": "LazyCCD against corrected Bullet"}


@table("behaviour/paths")
def paths():
    """The end of each scene, double precision."""
    last = {}
    for row in read("behaviour/paths.csv", precision="double"):
        last[row["scene"], row["world"]] = row
    return ["scene", "world", "m/s", "steps", *PAIRS.values()], [
        [scene, world, row["m/s"], count(row["step"])] +
        [f"{float(row[f'{pair}: mean']):.2f} / {float(row[f'{pair}: largest']):.2f}" for pair in PAIRS]
        for (scene, world), row in last.items()]
