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

test('the page is ready within a second, with less than 300 kB in all', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  const loaded = await page.evaluate(() => {
    const [navigation] = performance.getEntriesByType('navigation');
    const files = performance.getEntriesByType('resource').filter((each) => !each.name.includes('/api/'));
    return { size: [navigation, ...files].reduce((all, each) => all + each.decodedBodySize, 0), count: files.length };
  });
  assert.ok(loaded.count > 10, `${loaded.count} files`);
  const withPlots = await (await fetch(`${web.url}/lib/dygraph.min.js`)).text();
  assert.ok(loaded.size + withPlots.length <= 300_000, `${loaded.size} + ${withPlots.length}`);
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
