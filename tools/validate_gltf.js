// Says what the Khronos validator finds in files: node validate_gltf.js MODULE FILE... Fails on errors and warnings; infos
// are printed.
const fs = require("fs");
const [module_, ...files] = process.argv.slice(2);
const validator = require(module_);

async function main() {
  let bad = 0;
  for (const file of files) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 50 });
    const { numErrors, numWarnings, messages } = report.issues;
    bad += numErrors + numWarnings;
    for (const m of messages) console.log(`${file}: ${m.code} at ${m.pointer}: ${m.message}`);
  }
  process.exit(bad === 0 ? 0 : 1);
}
main();
