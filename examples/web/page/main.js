// Starts the page, or says in words why it cannot.
import { isSupported } from "./instantiate.js";

async function start() {
  say("Loading the scenes (1 MB)…");
  if (!isSupported()) {
    throw new Error("this browser lacks SIMD or exceptions of WebAssembly. Chrome 95, Firefox 100, "
      + "Safari 16.4 and later ones have both.");
  }
  if (!document.createElement("canvas").getContext("webgl")) {
    throw new Error("this browser cannot draw with WebGL here. Perhaps it is switched off in the settings.");
  }
  const { startPage } = await import("./page.js");
  Object.assign(window.lazyccd, await startPage());
  say("");
  return true;
}

function say(text) {
  const message = document.getElementById("message");
  message.textContent = text;
  message.hidden = text === "";
}

function fail(error) {
  say(`The page cannot go on: ${error.message}`);
  document.getElementById("page").hidden = true;
  return false;
}

window.addEventListener("error", (event) => fail(event));

// For tests. `ready` gives false if the page could not start.
window.lazyccd = {};
window.lazyccd.ready = start().catch(fail);
