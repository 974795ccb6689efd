// node gltf_validates.js FILE.glb...: the Khronos glTF validator (npm package gltf-validator). Exit status 1 for errors.
const fs = require('fs');
const validator = require('gltf-validator');
(async () => {
  let errors = 0;
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {uri: file});
    errors += report.issues.numErrors;
    console.log(`errors ${report.issues.numErrors} warnings ${report.issues.numWarnings}`);
    for (const m of report.issues.messages) if (m.severity < 2) console.log(m.code, m.pointer, m.message);
  }
  process.exit(errors > 0 ? 1 : 0);
})();
