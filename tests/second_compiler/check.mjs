// Compiles every .wgsl file of a folder with Tint, the WGSL compiler of Chrome, on Dawn's null backend: no GPU is touched.
//
// Why a second compiler: the one inside wgpu accepts texts that the specification forbids, above all barriers that not all
// invocations reach. What passes here with default limits is portable WebGPU.
//
// usage: node check.mjs FOLDER

import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import process from 'node:process';
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);

// Forbidden, and accepted by compilers that do not look at uniformity.
const DIVERGENT_BARRIER = `@compute @workgroup_size(64)
fn divergent(@builtin(local_invocation_index) lane: u32) { if (lane < 3u) { workgroupBarrier(); } }`;

// The names of the functions marked as compute shaders; attributes may come in any order.
function entryPoints(text) {
    const code = text.replace(/\/\/.*$/gm, '');
    return [...code.matchAll(/@compute\b\s*(?:@\w+\s*(?:\([^)]*\)\s*)?)*fn\s+(\w+)/g)].map((match) => match[1]);
}

// Everything that Tint and Dawn have to say about one module. Line 0: about the module as a whole.
async function complaints(device, text) {
    const error = (message) => ({ type: 'error', line: 0, column: 0, message });
    device.pushErrorScope('validation');
    const module = device.createShaderModule({ code: text });
    const { messages } = await module.getCompilationInfo();
    const found = messages.map(({ type, lineNum, linePos, message }) => ({ type, line: lineNum, column: linePos, message }));
    const invalid = await device.popErrorScope();
    if (invalid) {
        return found.some(({ type }) => type === 'error') ? found : [...found, error(invalid.message)];
    }
    const entries = entryPoints(text);
    if (entries.length === 0) {
        found.push(error('no entry point'));
    }
    for (const entryPoint of entries) {
        try {
            await device.createComputePipelineAsync({ layout: 'auto', compute: { module, entryPoint } });
        } catch (why) {
            found.push(error(`pipeline ${entryPoint}: ${why.message}`));
        }
    }
    return found;
}

async function checkFolder(folder) {
    // Dawn lives as long as this object does, and Node would wait for it: keep it local.
    const gpu = create(['backend=null']);
    const adapter = await gpu.requestAdapter();
    if (!adapter) {
        throw new Error('Dawn offers no null adapter');
    }
    const device = await adapter.requestDevice();
    if (!(await complaints(device, DIVERGENT_BARRIER)).some(({ type }) => type === 'error')) {
        throw new Error('a barrier under divergent control flow was accepted: this compiler checks nothing');
    }
    const files = readdirSync(folder).filter((name) => name.endsWith('.wgsl')).sort();
    if (files.length === 0) {
        throw new Error(`no .wgsl file in ${folder}`);
    }
    const count = { error: 0, warning: 0, info: 0 };
    let pipelines = 0;
    // Modules share most of their text: a complaint about the same line is told once.
    const told = new Map();
    for (const name of files) {
        const path = join(folder, name);
        const text = readFileSync(path, 'utf8');
        const lines = text.split('\n');
        pipelines += entryPoints(text).length;
        for (const { type, line, column, message } of await complaints(device, text)) {
            count[type] += 1;
            const key = `${type}\n${message}\n${lines[line - 1]}`;
            const before = told.get(key) ?? 0;
            told.set(key, before + 1);
            if (before === 0) {
                console.log(`${path}:${line}:${column}: ${type}: ${message}\n    ${lines[line - 1]?.trim() ?? ''}`);
            }
        }
    }
    device.destroy();
    const repeated = [...told.values()].reduce((sum, times) => sum + times - 1, 0);
    console.log(
        `Tint: ${files.length} modules, ${pipelines} pipelines, ${count.error} errors, ${count.warning} warnings` +
            (repeated > 0 ? ` (${repeated} repeat one above)` : ''),
    );
    return count.error === 0;
}

const folder = process.argv[2];
if (!folder) {
    console.error('usage: node check.mjs FOLDER');
    process.exit(2);
}
try {
    process.exitCode = (await checkFolder(folder)) ? 0 : 1;
} catch (why) {
    console.error(`error: ${why.message}`);
    process.exitCode = 1;
}
