// Builds the page: one file with script, style and the licences of the libraries. Writes it to the file named first.
import { build } from 'esbuild';
import { readFileSync, writeFileSync } from 'node:fs';

const [, , target, sources] = process.argv;
const here = (path) => new URL(path, import.meta.url).pathname;
const read = (path) => readFileSync(here(path), 'utf8');

async function bundled(entry) {
  const result = await build({ entryPoints: [here(entry)], bundle: true, minify: true, write: false, format: 'iife', target: 'es2022',
                               charset: 'ascii', legalComments: 'none', absWorkingDir: here('.'), logLevel: 'warning' });
  return result.outputFiles[0].text.trim();
}

// Text inside of a script element must not contain what ends it or starts a comment.
const inScript = (text) => text.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
const inText = (text) => text.replaceAll('&', '&amp;').replaceAll('<', '&lt;');

const libraries = Object.entries(JSON.parse(read('package.json')).dependencies);
const licences = libraries.map(([name, version]) => `${name} ${version}\n\n${read(`node_modules/${name}/LICENSE`).trim()}`).join('\n\n\n');
const parts = {
  SOURCES: sources,
  STYLE: await bundled('src/style.css'),
  LICENCES: inText(licences),
  SCRIPT: inScript(await bundled('src/main.ts')),
};
writeFileSync(target, read('index.html').replace(/@(\w+)@/g, (_, name) => parts[name]));
