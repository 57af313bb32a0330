// What the page shows during an interruption and after it: old values never look like new ones.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { awaitText, Browser, picture, violations } from './browser.mjs';
import { Plant, squareRootUuid, until } from './plant.mjs';

const plant = await Plant.start();
let browser;
let web;
let gateway;

before(async () => {
  browser = await Browser.start();
  await plant.cnc();
  gateway = await plant.gateway();
  await plant.squareRoot();
  web = await plant.web();
});

after(async () => {
  await browser?.stop();
  await plant.stop();
});

const isWell = (page) => awaitText(page, '.headline h1', /All is well/);

test('a page that is loaded again shows the same', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await isWell(page);
  await page.reload();
  await isWell(page);
  assert.deepEqual(browser.complaints, []);
  await page.close();
});

test('eight tabs of one browser all follow the plant, also after the first one is closed', async () => {
  const tabs = [await browser.open(web.url, { view: '#/calls' })];
  while (tabs.length < 8) {
    tabs.push(await browser.open(web.url, { view: '#/calls', beside: tabs[0] }));
  }
  const show = (request) => Promise.all(tabs.map((tab) => awaitText(tab, 'tr[data-call] .cell-request', request)));
  await plant.request(1, squareRootUuid, '16');
  await show(/16/);
  for (const tab of tabs) {
    assert.equal(await tab.evaluate(async () => (await fetch('/api/about')).status), 200);
    assert.equal(await tab.$eval('.lost', (node) => node.hidden), true);
  }
  await tabs.shift().close();
  await tabs[0].reload();
  await plant.request(1, squareRootUuid, '49');
  await show(/49/);
  assert.deepEqual(browser.complaints, []);
  await Promise.all(tabs.map((tab) => tab.close()));
});

test('a browser without shared workers has a connection for the visible tab', async () => {
  const page = await browser.open(web.url, { view: '#/plant', without: ['SharedWorker'] });
  await isWell(page);
  const other = await browser.open(web.url, { view: '#/plant', without: ['SharedWorker'], beside: page });
  await isWell(other);
  await awaitText(page, '.lost', /No data since/);
  await page.bringToFront();
  await isWell(page);
  assert.deepEqual(browser.complaints, []);
  await page.close();
});

test('while millrace web is down the page shows since when it has no data, and afterwards what it missed', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await isWell(page);
  await web.stop('SIGKILL');
  await awaitText(page, '.lost', /No data since \d\d:\d\d:\d\d/, 8000);
  await awaitText(page, '.headline h1', /State unknown/);
  assert.match(await page.title(), /^\(\?\)/);
  assert.equal(await page.$eval('main', (node) => getComputedStyle(node).filter), 'grayscale(1)');
  assert.deepEqual(await violations(page), []);
  await picture(page, 'lost');
  await plant.request(2, squareRootUuid, '81');
  web = await plant.web({ port: web.port });
  await awaitText(page, '.again', /No data from .* to .*was restarted/);
  await isWell(page);
  await page.waitForFunction(() => document.querySelector('.lost').hidden);
  await page.click('.again button');
  await page.waitForFunction(() => document.querySelector('.again').hidden);
  browser.forgetUnreachable();
  assert.deepEqual(browser.complaints, []);
  await page.close();
});

test('a list of calls has a row where data is missing', async () => {
  const page = await browser.open(web.url, { view: '#/calls' });
  await plant.request(1, squareRootUuid, '25');
  await awaitText(page, 'tr[data-call] .cell-request', /25/);
  await web.stop();
  await awaitText(page, '.lost', /No data since/, 8000);
  web = await plant.web({ port: web.port });
  await awaitText(page, 'tr[data-missing="gap"]', /no data from \d\d:\d\d:\d\d to/);
  await awaitText(page, 'tr[data-call] .cell-request', /25/);
  browser.forgetUnreachable();
  assert.deepEqual(browser.complaints, []);
  await page.close();
});

test('a gateway that is gone is shown as such, and so is its return', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await isWell(page);
  await gateway.stop('SIGKILL');
  await awaitText(page, '.concern[data-kind="gateway gone"] .concern-name', /^cnc$/);
  await awaitText(page, '.concern .who', /Plant engineer/);
  await awaitText(page, '.concern .concern-why', /The gateway on \S+, pid \d+, does not respond/);
  const diagnoses = await (await fetch(`${web.url}/api/doctor`)).json();
  const gone = diagnoses.diagnoses.filter((each) => /^cnc: gateway does not respond/.test(each.what));
  assert.equal(gone.length, 1, JSON.stringify(diagnoses.diagnoses));
  assert.deepEqual(await violations(page), []);
  await picture(page, 'gateway-gone');
  gateway = await plant.gateway();
  await isWell(page);
  await plant.request(1, squareRootUuid, '36');
  await until(async () => (await (await fetch(`${web.url}/api/calls`)).json()).calls.some((call) => call.request === '36'), 'a call by the new gateway');
  assert.deepEqual(browser.complaints, []);
  await page.close();
});
