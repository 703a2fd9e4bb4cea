// The parts of the data inside a file. Each part is compressed with zlib, as base64 in an element of its own. The program
// writes them (launch/src/page/single_file.rs).

/** Tests whether the browser can unpack the parts. */
export const canUnpack = () => typeof DecompressionStream !== "undefined";

/** Unpacks a part: resolves to a Response. Its reading fails if the part is damaged, because the format has a checksum. */
export async function unpack(document, name) {
  const packed = atob(document.querySelector(`[data-part="${name}"]`).textContent);
  const bytes = new Uint8Array(packed.length);
  for (let at = 0; at < packed.length; at += 1) bytes[at] = packed.charCodeAt(at);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}
