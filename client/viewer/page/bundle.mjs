// Bundles the page into a folder, each file compressed. usage: node bundle.mjs FOLDER
import {mkdirSync, readFileSync, writeFileSync} from "node:fs";
import {dirname, join} from "node:path";
import {fileURLToPath} from "node:url";
import {gzipSync} from "node:zlib";

import {build} from "esbuild";

const source = join(dirname(fileURLToPath(import.meta.url)), "src");
const folder = process.argv[2];
const {outputFiles} = await build({
  entryPoints: [join(source, "app.js"), join(source, "app.css")],
  outdir: folder,
  bundle: true,
  minify: true,
  write: false,
  format: "esm",
  target: "es2022",
  legalComments: "eof",
  conditions: ["browser"],
  loader: {".descriptors": "binary"},
  logLevel: "warning",
});
const files = new Map(outputFiles.map((file) => [file.path.slice(folder.length + 1), file.contents]));
for (const name of ["index.html", "icon.svg"]) files.set(name, readFileSync(join(source, name)));
mkdirSync(folder, {recursive: true});
let total = 0;
for (const [name, content] of files) {
  const compressed = gzipSync(content, {level: 9});
  total += compressed.length;
  writeFileSync(join(folder, `${name}.gz`), compressed);
}
console.log(`the viewer's page: ${total} bytes compressed`);
