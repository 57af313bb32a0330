// The view of machine data and programs, with a machine that changes.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, afterEach, before, test } from 'node:test';
import { awaitText, Browser, picture, textOf, violations } from './browser.mjs';
import { Plant, until } from './plant.mjs';

const plant = await Plant.start();
const recording = plant.file('run.mcap');
let browser;
let web;
let gateway;
let recorder;
let turning;

before(async () => {
  browser = await Browser.start();
  plant.file('good.nc', '%good\nV.E.PARTS = 17\n#FLUSH WAIT\n#TIME 5\nM30\n');
  plant.file('bad.nc', '%bad\n#FLUSH WAIT\n#TIME 0.3\n#FLUSH WAIT\nP1 = 1 / 0\nM30\n');
  const config = plant.file('cnc.textproto', `
    external_variable { name: "PARTS" type: UNS32 }
    external_variable { name: "LEVEL" type: REAL64 }
    external_variable { name: "LABEL" type: STRING }
    external_variable { name: "TABLE" type: SGN32 array_elements: 5 }
    external_variable { name: "READY" type: BOOLEAN }\n`);
  await plant.cnc('--config', config);
  gateway = await plant.configuredGateway(`
    programs { period_ms: 20 name: "mc_program_name_r" error: "mc_error_id_r" counter: "V.E.PARTS" }
    data { name: "fast" variable: ["V.E.LEVEL", "state", "V.E.PARTS", "V.E.READY"] period_ms: 100 }
    data { name: "slow" variable: ["V.E.LABEL", "V.E.TABLE", "V.E.NONE"] period_ms: 500 }`);
  web = await plant.web({ flags: ['--recordings', plant.folder] });
  recorder = plant.recorder(recording);
  await recorder.ready();
  let level = 0;
  turning = setInterval(() => {
    level += 1;
    plant.write(1, 'V.E.LEVEL', String((10 * Math.sin(level / 4)).toFixed(3))).catch(() => {});
  }, 300);
});

after(async () => {
  clearInterval(turning);
  await browser?.stop();
  await plant.stop();
});

afterEach(() => browser.expectNoComplaints());

const row = (name) => `tr[data-variable="1/${name}"]`;
const line = (name) => `.line[data-variable="1/${name}"]`;
const tick = (page, name) => page.click(`${row(name)} input`);

test('the view is there when a gateway publishes data, and shows lines, values and their quality', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await page.waitForFunction(() => !document.querySelector('[data-tab="data"]').hidden);
  await page.click('[data-tab="data"]');
  await awaitText(page, 'h1', /^Data and NC programs$/);
  // Before a choice is made, the first numbers are shown.
  await page.waitForSelector(`${line('fast/V.E.LEVEL')} .plot-line[d^=M]`);
  await awaitText(page, `${row('fast/state')} .cell-value`, /^selected \(2\)$/);
  await awaitText(page, `${row('slow/V.E.TABLE')} .cell-value`, /^0; 0; 0; 0; 0$/);
  await awaitText(page, `${row('slow/V.E.NONE')} .cell-quality`, /refused.*symbol not found/);
  await awaitText(page, `${row('fast/V.E.READY')} .cell-value`, /^FALSE$/);
  const before = await textOf(page, `${line('fast/V.E.LEVEL')} strong`);
  await page.waitForFunction((selector, old) => document.querySelector(selector).textContent !== old, {}, `${line('fast/V.E.LEVEL')} strong`, before);
  await page.close();
});

test('the selection is in the address, and a new page has the last minutes at once', async () => {
  const page = await browser.open(web.url, { view: '#/data' });
  await page.waitForSelector(row('slow/V.E.LABEL'));
  await tick(page, 'slow/V.E.LABEL');
  await page.waitForSelector(line('slow/V.E.LABEL'));
  await plant.write(1, 'V.E.LABEL', 'batch <7>');
  await awaitText(page, `${line('slow/V.E.LABEL')} .changes`, /“"batch <7>"”|batch <7>/);
  await tick(page, 'fast/state');
  await page.waitForFunction((selector) => !document.querySelector(selector), {}, line('fast/state'));
  await page.select('.filter label:nth-of-type(2) select', '60');
  const address = await page.evaluate(() => location.hash);
  assert.match(address, /machine=cnc/);
  assert.match(address, /span=60/);
  assert.match(decodeURIComponent(address), /show=1\/slow\/V\.E\.LABEL/);
  assert.doesNotMatch(decodeURIComponent(address), /show=1\/fast\/state/);
  const again = await browser.open(web.url, { view: address });
  await awaitText(again, `${line('slow/V.E.LABEL')} .changes`, /batch <7>/);
  await again.waitForSelector(`${line('fast/V.E.LEVEL')} .plot-line[d^=M]`);
  // The samples from before this page was opened.
  const first = await again.evaluate(async () => {
    const answer = await (await fetch('/api/data/history?machine=cnc&variable=1/fast/V.E.LEVEL')).json();
    return answer.series[0].times.length;
  });
  assert.ok(first > 3, `${first} points`);
  assert.equal(await again.$(line('fast/state')), null);
  await page.close();
  await again.close();
});

test('a program shows how it runs and how it ended, over the lines and in the table', async () => {
  const page = await browser.open(web.url, { view: '#/data?machine=cnc&span=60&show=1/fast/V.E.LEVEL&show=1/fast/state' });
  await page.waitForSelector(`${line('fast/state')} .plot-line[d^=M]`);
  await plant.runProgram('good.nc');
  await page.waitForSelector('.band-run[data-state="running"]');
  await awaitText(page, 'tr[data-state="running"] .cell-program', /good\.nc/);
  await page.waitForSelector('.band-run[data-state="ended"]');
  await awaitText(page, 'tr[data-state="ended"] .cell-parts', /^17$/);
  await plant.runProgram('bad.nc');
  await page.waitForSelector('.band-run[data-state="aborted"]');
  await awaitText(page, 'tr[data-state="aborted"] .cell-outcome', /aborted/);
  await awaitText(page, 'tr[data-state="aborted"] .cell-error', /^\d+$/);
  const plantPage = await browser.open(web.url, { view: '#/plant' });
  await awaitText(plantPage, '.concern[data-kind="program aborted"] .concern-name', /^cnc\/1$/);
  await awaitText(plantPage, '.headline h1', /1 channel needs attention/);
  assert.deepEqual(await violations(plantPage), []);
  await picture(plantPage, 'aborted');
  await plantPage.close();
  // The bars share the time axis of the lines.
  const [lane, plot] = await page.evaluate(() => ['.band-lane', '.plot-field'].map((each) => document.querySelector(each).getBoundingClientRect().toJSON()));
  assert.ok(Math.abs(lane.left - plot.left) <= 1 && Math.abs(lane.right - plot.right) <= 1, JSON.stringify([lane, plot]));
  await page.setViewport({ width: 1280, height: 600 });
  await picture(page, 'data');
  const { runs } = await (await fetch(`${web.url}/api/programs/runs?machine=cnc`)).json();
  assert.deepEqual(runs.map((run) => run.state), ['aborted', 'ended']);
  const metrics = await (await fetch(`${web.url}/metrics`)).text();
  assert.match(metrics, /millrace_programs_total\{machine="cnc",channel="1",result="aborted"\} 1\n/);
  await page.close();
});

for (const dark of [false, true]) {
  test(`axe finds nothing in the view data, ${dark ? 'dark' : 'light'}`, async () => {
    const page = await browser.open(web.url, { view: '#/data', dark });
    await page.waitForSelector('.line .plot-line[d^=M]');
    await page.waitForSelector(row('fast/state'));
    await page.waitForSelector('.band-run');
    assert.deepEqual(await violations(page), []);
    await picture(page, `data-${dark ? 'dark' : 'light'}`);
    await page.setViewport({ width: 390, height: 844 });
    assert.deepEqual(await violations(page), []);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'wider than a phone');
    await picture(page, `data-phone-${dark ? 'dark' : 'light'}`);
    await page.close();
  });
}

test('the keyboard chooses a variable, and its place stays', async () => {
  const page = await browser.open(web.url, { view: '#/data?machine=cnc&show=' });
  await page.waitForSelector(row('fast/V.E.PARTS'));
  await page.focus(`${row('fast/V.E.PARTS')} input`);
  await page.keyboard.press('Space');
  await page.waitForSelector(line('fast/V.E.PARTS'));
  assert.equal(await page.evaluate(() => document.activeElement.closest('tr')?.dataset.variable), '1/fast/V.E.PARTS');
  await page.close();
});

test('the page is in German for a German browser', async () => {
  const page = await browser.open(web.url, { view: '#/data', language: 'de' });
  await awaitText(page, 'h1', /^Daten und NC-Programme$/);
  await awaitText(page, '.cell-quality', /gut/);
  await page.close();
});

test('a wall shows the lines that were chosen, and nothing to press', async () => {
  const page = await browser.open(web.url, { query: '?wall', view: '#/data?machine=cnc&show=1/fast/V.E.LEVEL&show=1/fast/state', width: 1920, height: 1080, dark: true });
  await page.waitForSelector('.line .plot-line[d^=M]');
  assert.deepEqual(await page.$$eval('main :is(button, input, select)', (all) => all.filter((each) => each.checkVisibility()).length), 0);
  assert.ok(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight));
  assert.deepEqual(await violations(page), []);
  await picture(page, 'data-wall');
  await page.close();
});

test('without its gateway the values are stale and the lines have a gap', async () => {
  const page = await browser.open(web.url, { view: '#/data?machine=cnc&span=60&show=1/fast/V.E.LEVEL' });
  await page.waitForSelector(`${line('fast/V.E.LEVEL')}[data-quality="good"]`);
  await gateway.stop('SIGKILL');
  await page.waitForSelector(`${line('fast/V.E.LEVEL')}[data-quality="stale"]`);
  await awaitText(page, `${row('fast/V.E.LEVEL')} .cell-quality`, /stale.*no longer reported/);
  const last = await page.evaluate(async () => (await (await fetch('/api/data/history?machine=cnc&variable=1/fast/V.E.LEVEL')).json()).series[0].values.at(-1));
  assert.equal(last, null);
  await picture(page, 'data-stale');
  await page.close();
});

test('what a replay sends is shown as replayed', async () => {
  await recorder.stop();
  const replay = plant.replayData(recording, '--rate', '2', '--channel', 'cnc=yesterday');
  const page = await browser.open(web.url, { view: '#/data?machine=yesterday' });
  await awaitText(page, '.data-table .cell-quality .replayed', /replayed/);
  // It takes half as long as the recording that it replays.
  assert.equal(await replay.ended, 0, replay.errors);
  await awaitText(page, 'tr[data-state="aborted"] .cell-outcome', /aborted replayed/);
  await page.waitForSelector('.line[data-quality="stale"]');
  await page.close();
});

test('a recording shows the alarms of processes', async () => {
  // The actions of a second recorder.
  const file = plant.file('second.mcap');
  const second = plant.recorder(file);
  await second.ready();
  const third = plant.recorder(plant.file('third.mcap'));
  await third.ready();
  await until(async () => (await (await fetch(`${web.url}/api/alarms`)).json()).some((each) => /third/.test(each.text)), 'the word of the third recorder');
  // The second recorder has received it too: a later one receives only the end.
  await until(() => readFileSync(`${file}.part`).includes('third.mcap'), 'the word of the third recorder in the second');
  await third.stop();
  await second.stop();
  const page = await browser.open(web.url, { view: '#/recordings/second.mcap' });
  await awaitText(page, '.alarms td', /third\.mcap/);
  assert.deepEqual(await violations(page), []);
  await page.close();
});
