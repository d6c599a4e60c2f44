"""Drives the page in a headless Chromium with WebGL in software, and prints what each scene gave.

    test_page.py FOLDER NATIVE PICTURES
      FOLDER     the page, ready to be served
      NATIVE     output of lazyccd_page_scenes 300
      PICTURES   folder that keeps the screenshots

Needs Debian's packages chromium, chromium-driver and python3-selenium.
"""
import functools
import gzip
import http.server
import json
import pathlib
import sys
import threading
import time

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

STEPS = 300
PICTURE_AFTER = {"cloth-on-cloth": 16, "ball-on-net": 25, "skirt": 300}  # steps; others: 60
SECONDS_TO_MOVE = 2
OPENINGS = 3  # the fastest counts: other work may delay one
MOST_BYTES = 2.5e6  # of all files, compressed
DESKTOP, PHONE = (1280, 900), (360, 740)
# The second step follows the first drawing.
NOTE_WHEN_IT_MOVES = """
    window.moved = new Promise((resolve) => {
      const look = (now) => {
        if (window.lazyccd?.state?.().steps >= 2) resolve(now);
        else requestAnimationFrame(look);
      };
      requestAnimationFrame(look);
    });
"""
# Its path uses sin and cos, which other C libraries round in other ways.
OWN_MATHEMATICS = {"skirt"}
# Messages of the software drawing, not of the page.
OF_THE_BROWSER = ("GL Driver Message", "software WebGL")


class Handler(http.server.SimpleHTTPRequestHandler):
    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map,
                      ".wasm": "application/wasm", ".js": "text/javascript"}

    def log_message(self, *_):
        pass


class Checks:
    """Prints each check; remembers if one failed."""

    def __init__(self):
        self.failed = 0

    def __call__(self, passed, what):
        print(f"{'ok  ' if passed else 'FAIL'}  {what}", flush=True)
        self.failed += not passed


def serve(folder):
    """Returns the address at which the folder is served."""
    handler = functools.partial(Handler, directory=folder)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return f"http://127.0.0.1:{server.server_port}/"


def open_browser(*more_arguments):
    options = webdriver.ChromeOptions()
    options.binary_location = "/usr/bin/chromium"
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--use-gl=angle",
                     "--use-angle=swiftshader", "--enable-unsafe-swiftshader", *more_arguments):
        options.add_argument(argument)
    browser = webdriver.Chrome(service=Service("/usr/bin/chromedriver"), options=options)
    browser.set_script_timeout(300)
    return browser


def set_size(browser, size):
    """Sets the size of the page itself, also below the least width of a window."""
    width, height = size
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
        "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 500})


def call(browser, expression):
    """Returns the value of an expression of JavaScript; waits if it is a promise."""
    answer = browser.execute_async_script(
        "const done = arguments[0];"
        f"Promise.resolve({expression})"
        ".then((value) => done({value}), (error) => done({error: `${error}`}));")
    if "error" in answer:
        raise RuntimeError(answer["error"])
    return answer["value"]


def state(browser):
    return call(browser, "lazyccd.state()")


def text_of_focus(browser):
    """Names the element that has the focus; radio buttons of a group count as one."""
    return browser.execute_script(
        "const e = document.activeElement; return e.type === 'radio' ? e.name : e.id || e.parentElement.id;")


def check_size(folder, check):
    total = sum(len(gzip.compress(f.read_bytes())) for f in pathlib.Path(folder).rglob("*") if f.is_file())
    check(total <= MOST_BYTES, f"all files: {total / 1e6:.2f} MB compressed")


def check_opening(browser, address, check):
    browser.execute_cdp_cmd("Network.enable", {})
    browser.execute_cdp_cmd("Network.setCacheDisabled", {"cacheDisabled": True})
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": NOTE_WHEN_IT_MOVES})
    seconds = []
    for _ in range(OPENINGS):
        browser.get(address)
        seconds.append(call(browser, "moved") / 1000)
    check(min(seconds) <= SECONDS_TO_MOVE, "moves after " + ", ".join(f"{s:.2f}" for s in seconds) + " s")


def check_keyboard(browser, check):
    wanted = {"scene", "speed", "size", "pause", "step", "restart", "contacts", "left", "right"}
    reached = set()
    for _ in range(len(wanted) + 3):
        ActionChains(browser).send_keys(Keys.TAB).perform()
        reached.add(text_of_focus(browser))
    check(wanted <= reached, f"Tab reaches every control {sorted(wanted - reached) or ''}")

    browser.execute_script("document.activeElement.blur();")
    before = state(browser)["paused"]
    ActionChains(browser).send_keys(Keys.SPACE).perform()
    between = state(browser)["paused"]
    ActionChains(browser).send_keys(Keys.SPACE).perform()
    check(not before and between and not state(browser)["paused"], "Space pauses, and goes on")

    call(browser, "lazyccd.select(0)")
    browser.find_element(By.ID, "step").send_keys(Keys.ENTER)
    check(state(browser)["steps"] == 1, "the key Enter on Step makes one step")


def check_pull(browser, check):
    """Pulls a corner of the cloth in the middle of Bullet's side; both sides must follow."""
    free = call(browser, "(lazyccd.select(1), lazyccd.run(20))")
    call(browser, "lazyccd.select(1)")
    canvas = browser.find_element(By.CSS_SELECTOR, "#left canvas")
    ActionChains(browser).move_to_element(canvas).click_and_hold().move_by_offset(0, -60).perform()
    pulled = call(browser, "lazyccd.run(20)")
    ActionChains(browser).release().perform()
    check(all(free[side]["hash"] != pulled[side]["hash"] for side in free), "a pull moves both sides")


def check_camera(browser, check):
    """Turns and zooms by mouse, keys and two fingers."""
    canvas = browser.find_element(By.CSS_SELECTOR, "#right canvas")
    box = canvas.rect
    corner = (20 - box["width"] / 2, 20 - box["height"] / 2)

    def moved(what, how, act):
        before = state(browser)["camera"]
        act()
        after = state(browser)["camera"]
        changed = {name for name in before if before[name] != after[name]}
        check(changed == what, f"camera: {' and '.join(sorted(what))} by {how}")

    def drag():
        at_corner = ActionChains(browser).move_to_element_with_offset(canvas, *corner)
        at_corner.click_and_hold().move_by_offset(40, 30).release().perform()

    def turn_wheel():
        ActionChains(browser).scroll_from_origin(ScrollOrigin.from_element(canvas), 0, 100).perform()

    def pinch():
        x, y = box["x"] + 20, box["y"] + 20
        for kind, gap in (("touchStart", 20), ("touchMove", 30), ("touchMove", 40)):
            browser.execute_cdp_cmd("Input.dispatchTouchEvent", {
                "type": kind, "touchPoints": [{"x": x, "y": y, "id": 0}, {"x": x + gap, "y": y, "id": 1}]})
        browser.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

    moved({"turn", "height"}, "dragging", drag)
    moved({"distance"}, "the wheel", turn_wheel)
    moved({"turn", "distance"}, "keys", lambda: canvas.send_keys(Keys.ARROW_LEFT, "+"))
    moved({"distance"}, "two fingers", pinch)


def check_scene(browser, index, native, pictures, check):
    """Runs a scene and returns a row of the table."""
    name = native["bullet"]["scene"]
    call(browser, f"lazyccd.select({index})")
    result = call(browser, f"lazyccd.run({STEPS})")
    left, right = result["left"], result["right"]
    check(right["passed"] == 0, f"{name}: nothing passes with LazyCCD")
    wanted = native["bullet"]["passed"]
    if name in OWN_MATHEMATICS:
        check(left["passed"] > 0 and wanted > 0, f"{name}: something passes with Bullet alone")
    else:
        check(left["passed"] == wanted,
              f"{name}: {left['passed']:.0f} pass with Bullet alone, natively {wanted}")
    call(browser, f"lazyccd.select({index})")
    call(browser, f"lazyccd.run({PICTURE_AFTER.get(name, 60)})")
    time.sleep(0.5)
    browser.save_screenshot(str(pictures / f"{name}.png"))
    return name, left["passed"], right["passed"], left["ms"], right["ms"]


def check_phone(browser, pictures, check):
    set_size(browser, PHONE)
    time.sleep(0.5)
    width = browser.execute_script("return document.documentElement.scrollWidth;")
    check(width <= PHONE[0], f"{PHONE[0]} px: nothing sticks out ({width} px)")
    browser.save_screenshot(str(pictures / "phone.png"))
    set_size(browser, DESKTOP)


def check_console(browser, check):
    messages = [entry["message"] for entry in browser.get_log("browser")
                if entry["level"] in ("SEVERE", "WARNING")
                and not any(words in entry["message"] for words in OF_THE_BROWSER)]
    check(not messages, "no message in the console" + "".join(f"\n      {m}" for m in messages))


def check_less_motion(address, check):
    browser = open_browser("--force-prefers-reduced-motion")
    try:
        browser.get(address)
        call(browser, "lazyccd.ready")
        check(state(browser)["paused"], "starts paused if less motion is preferred")
    finally:
        browser.quit()


def check_explosion(browser, check):
    """Lets the page believe that no position is finite."""
    call(browser, "import('/demo.js').then(({Demo}) => { Demo.prototype.isFinite = () => false; })")
    call(browser, "(lazyccd.select(0), lazyccd.run(2))")
    time.sleep(0.5)
    words = [element.text for element in browser.find_elements(By.CSS_SELECTOR, ".state")]
    check(words == ["exploded", "exploded"], f"a side that is not finite says: {words[0]}")


def check_words(address, what, words, check, *arguments, script="", blocked=()):
    """Opens a browser that lacks something: the page must say so."""
    browser = open_browser(*arguments)
    try:
        browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
        browser.execute_cdp_cmd("Network.enable", {})
        browser.execute_cdp_cmd("Network.setBlockedURLs", {"urls": list(blocked)})
        browser.get(address)
        ready = call(browser, "lazyccd.ready")
        said = browser.find_element(By.ID, "message").text
        check(not ready and words in said, f"without {what} it says: {said}")
    finally:
        browser.quit()


def read_native(path):
    """Returns the lines of both sides of each scene, in the order of the page."""
    scenes = {}
    for line in pathlib.Path(path).read_text().splitlines():
        row = json.loads(line)
        scenes.setdefault(row["scene"], {})["lazyccd" if row["with_lazyccd"] else "bullet"] = row
    return list(scenes.values())


def main(folder, native, pictures):
    pictures = pathlib.Path(pictures)
    pictures.mkdir(parents=True, exist_ok=True)
    check, address = Checks(), serve(folder)
    check_size(folder, check)
    browser = open_browser()
    try:
        set_size(browser, DESKTOP)
        check_opening(browser, address, check)
        check(call(browser, "lazyccd.ready"), "starts")
        check_keyboard(browser, check)
        check_pull(browser, check)
        rows = [check_scene(browser, index, scene, pictures, check)
                for index, scene in enumerate(read_native(native))]
        check_phone(browser, pictures, check)
        check_camera(browser, check)
        check_explosion(browser, check)
        check_console(browser, check)
    finally:
        browser.quit()
    check_less_motion(address, check)
    check_words(address, "WebGL", "WebGL", check, "--disable-gpu", "--disable-3d-apis")
    check_words(address, "SIMD", "SIMD", check, script="WebAssembly.validate = () => false;")
    check_words(address, "page.wasm", "fetch", check, blocked=["*page.wasm"])

    print(f"\n{'':16}{'pass-throughs':>20}{'ms of a step':>20}")
    print(f"{'scene':16}{'Bullet':>10}{'LazyCCD':>10}{'Bullet':>10}{'LazyCCD':>10}")
    for name, left, right, left_ms, right_ms in rows:
        print(f"{name:16}{left:10.0f}{right:10.0f}{left_ms:10.1f}{right_ms:10.1f}")
    return 1 if check.failed else 0


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
