// SPDX-License-Identifier: BSD-3-Clause
// What others read of a LAS file, a line a point:
//   node read_las.mjs copc FILE        x y z red green blue temperature
//   node read_las.mjs loaders FILE     x y z red green blue, colours of 8 bits
// after a line "# ..." of what the reader says of the file. Packages: package.json.
import { readFileSync } from 'node:fs';

const [reader, file] = process.argv.slice(2);
const bytes = new Uint8Array(readFileSync(file));
const lines = [];

if (reader === 'copc') {
  const { Las } = await import('copc');
  const header = Las.Header.parse(bytes);
  const get = async (begin, end) => bytes.slice(begin, end);
  const records = await Las.Vlr.walk(get, header);
  const extra = Las.Vlr.find(records, 'LASF_Spec', 4);
  const dimensions = extra ? Las.ExtraBytes.parse(await Las.Vlr.fetch(get, extra)) : [];
  lines.push(`# ${header.majorVersion}.${header.minorVersion} format ${header.pointDataRecordFormat} ` +
             `points ${header.pointCount} extra ${dimensions.map(d => `${d.name}:${d.type}${8 * d.length}`)}`);
  const end = header.pointDataOffset + header.pointCount * header.pointDataRecordLength;
  const view = Las.View.create(bytes.slice(header.pointDataOffset, end), header, dimensions);
  const columns = ['X', 'Y', 'Z', 'Red', 'Green', 'Blue', ...dimensions.map(d => d.name)].map(view.getter);
  for (let i = 0; i < view.pointCount; ++i) lines.push(columns.map(of => of(i)).join(' '));
} else {
  // The reader asks for its WebAssembly by address, which node's own fetch does for the web only.
  globalThis.fetch = async address => new Response(
      readFileSync(new URL(address.url ?? address)), { headers: { 'content-type': 'application/wasm' } });
  const { parse } = await import('@loaders.gl/core');
  const { LAZRsLoader } = await import('@loaders.gl/las');
  const read = await parse(bytes.buffer, LAZRsLoader, { worker: false, las: { fp64: true, colorDepth: 16 } });
  const { versionAsString, pointsFormatId, pointsCount } = read.loaderData;
  lines.push(`# ${versionAsString} format ${pointsFormatId} points ${pointsCount}`);
  const positions = read.attributes.POSITION.value, colors = read.attributes.COLOR_0.value;
  for (let i = 0; i < positions.length / 3; ++i)
    lines.push([...positions.slice(3 * i, 3 * i + 3), ...colors.slice(4 * i, 4 * i + 3)].join(' '));
}
process.stdout.write(lines.join('\n') + '\n');
