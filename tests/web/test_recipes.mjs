// Runs the programs of plugin/javascript/recipes.md as they stand there.
import assert from "node:assert/strict";
import { execFile } from "node:child_process";
import { cp, mkdtemp, readFile, rm, writeFile, mkdir } from "node:fs/promises";
import os from "node:os";
import path from "node:path";
import test from "node:test";
import { promisify } from "node:util";

const packageFolder = path.resolve(process.env.PACKAGE ?? "build/wasm/plugin/javascript/package");
const page = await readFile(new URL("../../plugin/javascript/recipes.md", import.meta.url), "utf8");
const recipes = [...page.matchAll(/^## (.*)\n[^]*?^```js\n([^]*?)^```/gm)];

const folder = await mkdtemp(path.join(os.tmpdir(), "lazyccd-"));
test.after(() => rm(folder, { recursive: true }));
await cp(packageFolder, path.join(folder, "node_modules/lazyccd"), { recursive: true });
const three = path.join(folder, "node_modules/three");
await mkdir(three);
await cp("/usr/share/javascript/three/three.module.js", path.join(three, "three.js"));
await writeFile(path.join(three, "package.json"), '{ "name": "three", "type": "module", "main": "three.js" }');

assert.ok(recipes.length >= 5);
for (const [, title, program] of recipes) {
  test(title, async () => {
    const file = path.join(folder, "recipe.mjs");
    await writeFile(file, program);
    const { stdout, stderr } = await promisify(execFile)(process.execPath, [file]);
    assert.equal(stderr, "");
    assert.doesNotMatch(stdout, /NaN|undefined/);
    if (title.startsWith("Bullet alone")) {
      const [alone, lazy] = [...stdout.matchAll(/at (.*)/g)].map((match) => Number(match[1]));
      assert.ok(lazy > 0 && alone !== lazy, stdout);
    }
  });
}
