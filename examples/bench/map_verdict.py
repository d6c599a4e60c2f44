"""What a point of the map of failures shows, as map.py and the page of failures say it."""

# Relative to the energy at the start. Bullet's integrators also change the whole energy.
ENERGY_LIMIT, RESPONSE_LIMIT = 0.05, 0.01


def verdict(row):
    if row["outcome"] != "ran":
        return "dies"
    if int(row["initial_intersections"]):
        return "unclean"
    if any(int(row[name]) for name in ("crossings", "intersections", "wrong_side")):
        return "through"
    if float(row["energy_gain"]) > ENERGY_LIMIT or float(row["response_gain"]) > RESPONSE_LIMIT:
        return "energy"
    return "held" if int(row["failsafe_holds"]) else "clean"
