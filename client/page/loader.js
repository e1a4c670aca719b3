// Starts the page once the library that it draws with is unpacked.
'use strict';

// The bytes of a script element that holds them as one zlib stream, in base64.
async function inflate(id) {
  const packed = Uint8Array.from(atob(document.getElementById(id).textContent), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
const inflateText = async (id) => new TextDecoder().decode(await inflate(id));

(async () => {
  const say = (text) => { document.getElementById('message').textContent = text; };
  if (typeof DecompressionStream === 'undefined') {
    say('This browser is too old for the page: it lacks DecompressionStream (2023).');
    return;
  }
  const start = (text) => document.body.append(Object.assign(document.createElement('script'), {textContent: text}));
  try {
    start(await inflateText('library'));
    for (const {textContent} of document.querySelectorAll('script.program')) start(textContent);
  } catch (error) {
    say(`The page is damaged: ${error.message}`);
  }
})();
