// How fast the page loads and reacts. Run it alone.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Browser } from './browser.mjs';
import { Plant, squareRootUuid } from './plant.mjs';

const plant = await Plant.start();
let browser;
let web;

before(async () => {
  browser = await Browser.start();
  await plant.cnc();
  await plant.gateway();
  await plant.squareRoot();
  web = await plant.web();
});

after(async () => {
  await browser?.stop();
  await plant.stop();
});

for (const language of ['en', 'de']) {
  test(`all views of one language are at most 250 kB, ${language}`, async () => {
    const page = await browser.open(web.url, { view: '#/plant', language });
    const sizes = () => page.evaluate(() => [...performance.getEntriesByType('navigation'), ...performance.getEntriesByType('resource')]
      .filter((each) => !each.name.includes('/api/')).map((each) => each.decodedBodySize));
    const first = await sizes();
    assert.ok(first.length > 10 && first.every((each) => each > 0), `${first}`);
    await page.evaluate(() => Promise.all(['call', 'calls', 'data', 'doctor', 'recordings', 'services'].map((view) => import(`/views/${view}.js`))));
    const all = await sizes();
    assert.ok(all.length > first.length, 'the other views are loaded when they are shown');
    const sum = (list) => list.reduce((a, b) => a + b, 0);
    console.log(`${language}: first view ${sum(first)} bytes, all ${sum(all)}`);
    assert.ok(sum(all) <= 250_000, `${sum(all)} bytes`);
    await page.close();
  });
}

test('the page is ready within a second', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  // The best of several, since other processes run on the test's host, too.
  const times = [];
  for (let i = 0; i < 5; i += 1) {
    await page.reload();
    await page.waitForSelector('html[data-ready]');
    times.push(await page.evaluate(() => performance.now()));
  }
  assert.ok(Math.min(...times) < 1000, `${times}`);
  await page.close();
});

test('a call is on the page within a second of its end', async () => {
  const page = await browser.open(web.url, { view: '#/calls' });
  await page.evaluate(() => {
    globalThis.arrivals = {};
    new MutationObserver((changes) => {
      for (const node of changes.flatMap((change) => [...change.addedNodes])) {
        if (node.dataset?.call) {
          globalThis.arrivals[node.dataset.call] = Date.now();
        }
      }
    }).observe(document.querySelector('table.calls tbody'), { childList: true });
  });
  const delays = [];
  for (const number of [21, 22, 23]) {
    await plant.request(1, squareRootUuid, String(number));
    const row = await page.waitForFunction((wanted) => [...document.querySelectorAll('tr[data-call]')]
      .find((each) => each.querySelector('.cell-request').textContent.includes(wanted)), { polling: 50 }, `“${number}” 1`);
    const call = await row.evaluate((node) => node.dataset.call);
    const { calls } = await (await fetch(`${web.url}/api/calls`)).json();
    const ended = Date.parse(calls.find((each) => each.call === call).ended);
    delays.push(await page.evaluate((id) => globalThis.arrivals[id], call) - ended);
  }
  assert.ok(Math.min(...delays) < 1000, `${delays} ms`);
  await page.close();
});
