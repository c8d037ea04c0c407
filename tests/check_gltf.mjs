// Validates GLBs with the Khronos glTF Validator and prints what it finds: a line for each file, then one for each error and warning.
// PIPELINE_GLTF_VALIDATOR names the folder of its npm package.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { resolve } from 'node:path';

const folder = resolve(process.env.PIPELINE_GLTF_VALIDATOR);
const validator = createRequire(import.meta.url)(folder);

for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 1000 });
    const { numErrors, numWarnings, messages } = report.issues;
    console.log(`${numErrors} errors, ${numWarnings} warnings: ${file}`);
    for (const { code, message, severity, pointer } of messages.filter(m => m.severity < 2)) {
        console.log(`${severity === 0 ? 'error' : 'warning'} ${code} ${pointer}: ${message}`);
    }
}
