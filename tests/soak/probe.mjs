// A thread of its own that asks /livez over a new connection every so often, so that what the load generator does in its
// thread is not measured. Posts the milliseconds that each took; an answer that is none counts as `giveUpMs`.
import { request } from 'node:http';
import { parentPort, workerData } from 'node:worker_threads';

const { everyMs, giveUpMs } = workerData;
let { url } = workerData;
const taken = [];
let running = true;

function ask() {
  const start = performance.now();
  return new Promise((done) => {
    const end = (ok) => done(ok ? performance.now() - start : giveUpMs);
    const asked = request(`${url}/livez`, { agent: false, timeout: giveUpMs }, (answer) => {
      answer.resume();
      answer.on('end', () => end(answer.statusCode === 200));
      answer.on('error', () => end(false));
    });
    asked.on('timeout', () => asked.destroy());
    asked.on('error', () => end(false));
    asked.end();
  });
}

parentPort.on('message', (message) => {
  if (message.url) url = message.url;
  else running = false;
});

while (running) {
  if (url) taken.push(await ask());
  await new Promise((done) => setTimeout(done, everyMs));
}
parentPort.postMessage(taken);
parentPort.close();
