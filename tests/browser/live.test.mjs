// The page with a working plant: it shows each change at once and correctly.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { awaitText, Browser, picture, textOf, violations } from './browser.mjs';
import { Plant, slowUuid, squareRootUuid, until } from './plant.mjs';

const plant = await Plant.start();
let browser;
let web;
let recording;

before(async () => {
  browser = await Browser.start();
  await plant.cnc();
  await plant.gateway();
  await plant.squareRoot('--name', 'root one');
  web = await plant.web();
});

after(async () => {
  await browser?.stop();
  await plant.stop();
});

afterEach(() => browser.expectNoComplaints());

/** What the row shows whose request has this text in it, once it is there. */
async function rowWith(page, text) {
  const handle = await page.waitForFunction((wanted) => [...document.querySelectorAll('tr[data-call]')]
    .find((each) => each.querySelector('.cell-request').textContent.includes(wanted)), { polling: 50 }, text);
  return handle.evaluate((node) => ({
    call: node.dataset.call, failed: node.dataset.failed, text: node.textContent, markup: node.querySelectorAll('img, script, b').length,
  }));
}

/** Makes a call on a channel and resolves with what its row shows. */
async function callShown(page, channel, text) {
  await plant.request(channel, squareRootUuid, text);
  return rowWith(page, `“${text}” 1`);
}

test('HTML and escapes in a request are text', async () => {
  const page = await browser.open(web.url, { view: '#/calls' });
  await plant.request(1, squareRootUuid, '<img src=x onerror=alert(1)><b>\u001b[31m', 7);
  const shown = await rowWith(page, '<b>\\x1b[31m” 7');
  assert.equal(shown.markup, 0);
  assert.match(shown.text, /<img src=x onerror=alert\(1\)>/);
  await page.goto(`${web.url}/#/calls/${shown.call}`);
  await awaitText(page, '.steps td', /<img src=x/);
  assert.equal(await page.$$eval('main img, main b', (nodes) => nodes.length), 0);
  await page.close();
});

test('the waterfall of a call has the steps that recording calls prints', async () => {
  recording = plant.file('run.mcap');
  const recorder = plant.recorder(recording);
  await recorder.ready();
  const page = await browser.open(web.url, { view: '#/calls' });
  const { call } = await callShown(page, 1, '1764');
  await recorder.stop();
  const wanted = JSON.parse(await plant.millrace('recording', 'calls', '--json', recording, call));
  await page.click(`tr[data-call="${call}"] a`);
  await awaitText(page, 'h1', new RegExp(call));
  await page.waitForSelector('.steps tbody tr[data-hop="written back"]');
  const steps = await page.$$eval('.steps tbody tr[data-hop]', (rows) => rows.map((each) => ({
    time: each.cells[0].textContent, hop: each.dataset.hop, attempt: Number(each.dataset.attempt), what: each.cells[4].textContent,
  })));
  const micros = (time) => `${time.slice(11, 19)}.${(time.split('.')[1] ?? 'Z').slice(0, -1).padEnd(6, '0').slice(0, 6)}`;
  assert.deepEqual(steps, wanted.steps.map((step) => ({
    time: micros(step.time),
    hop: step.hop,
    attempt: step.attempt,
    what: `${step.text === undefined ? '' : `“${step.text}” state ${step.state}`}${step.detail ? `${step.text === undefined ? '' : '  '}${step.detail.replace(/\(pid (\d+) on (\S+)\)/, '($2, pid $1)')}` : ''}`,
  })));
  assert.ok(steps.length >= 7, JSON.stringify(steps));
  // One lane for the gateway, one for the attempt, with every part of the call.
  assert.deepEqual(await page.$$eval('.lane', (lanes) => lanes.map((lane) => lane.dataset.attempt)), ['0', '1']);
  assert.deepEqual(await page.$$eval('.lane[data-attempt="1"] .bar', (bars) => bars.map((bar) => bar.dataset.part)),
    ['toService', 'queue', 'work', 'toGateway']);
  assert.deepEqual(await violations(page), []);
  await picture(page, 'call');
  await page.close();
});

test('the filter of calls is in the address and shows what fits', async () => {
  const slow = await plant.slowService();
  const page = await browser.open(web.url, { view: '#/plant' });
  await plant.request(2, slowUuid, 'never mind');
  await page.waitForSelector('[data-channel="cnc/2"][data-state="running"]');
  await plant.withdraw(2);
  await page.waitForSelector('[data-channel="cnc/2"][data-state="idle"]');
  await page.goto(`${web.url}/#/calls`);
  await callShown(page, 2, '49');
  await callShown(page, 1, '64');
  await page.goto(`${web.url}/#/calls?result=withdrawn&channel=2&machine=cnc`);
  await awaitText(page, 'tr[data-call] .cell-request', /never mind/);
  await awaitText(page, 'tr[data-call] .cell-result', /withdrawn/);
  const rows = await page.$$eval('tr[data-call]', (all) => all.map((each) => [each.querySelector('.cell-channel').textContent, each.dataset.failed]));
  assert.deepEqual(rows, [['cnc/2', 'true']]);
  assert.equal(await page.$$eval('.filter select', (all) => all.filter((each) => each.value).length), 3);
  await slow.stop();
  await page.close();
});

test('selection and input are in the address, the view stays, and the link shows the same', async () => {
  const page = await browser.open(web.url, { view: '#/calls' });
  await callShown(page, 1, '121');
  await callShown(page, 2, '121000');
  await callShown(page, 2, '-144');
  const requests = (each) => each.$$eval('tr[data-call] .cell-request .said', (all) => all.map((said) => said.textContent));
  const search = await page.$('.filter input[name="text"]');
  await search.type('121');
  await page.waitForFunction(() => location.hash === '#/calls?text=121');
  await page.waitForFunction(() => document.querySelectorAll('tr[data-call]').length === 2);
  assert.ok(await search.evaluate((node) => document.activeElement === node), 'who types goes on typing');
  await page.select('.filter label:nth-child(1) select', 'cnc');
  await page.select('.filter label:nth-child(2) select', '2');
  await page.waitForFunction(() => document.querySelectorAll('tr[data-call]').length === 1);
  assert.deepEqual(await requests(page), ['“121000”']);
  const other = await browser.open(web.url, { view: await page.evaluate(() => location.hash) });
  await other.waitForSelector('tr[data-call]');
  assert.deepEqual(await requests(other), ['“121000”']);
  await other.close();
  // Each choice is a history entry; the letters of a word are not.
  await page.goBack();
  await page.waitForFunction(() => location.hash === '#/calls?machine=cnc&text=121');
  await page.waitForFunction(() => document.querySelectorAll('tr[data-call]').length === 2);
  await picture(page, 'calls-filtered');
  await page.goto(`${web.url}/#/calls?result=other_state&text=144`);
  await awaitText(page, 'tr[data-call] .cell-result', /answered, state/);
  assert.deepEqual(await requests(page), ['“-144”']);
  await page.close();
});

test('a service that is killed turns its row, and the channel that calls it', async () => {
  const doomed = await plant.squareRoot('--name', 'doomed', '--uuid', '9d2b7c55-4e1f-4a53-8f0e-6a1f0c3b2d10');
  const page = await browser.open(web.url, { view: '#/services/9d2b7c55-4e1f-4a53-8f0e-6a1f0c3b2d10' });
  await awaitText(page, '.service[data-level="fine"] .service-name', /doomed/);
  await doomed.stop('SIGKILL');
  await awaitText(page, '.service[data-level="act"] .service-name', /doomed/, 5000);
  await awaitText(page, 'tr[data-state="gone"] .cell-state', /ended \d\d:\d\d/);
  await page.goto(`${web.url}/#/plant`);
  await plant.request(3, '9d2b7c55-4e1f-4a53-8f0e-6a1f0c3b2d10', '2');
  await page.waitForSelector('[data-channel="cnc/3"][data-state="unserved"]');
  await awaitText(page, '.concern[data-kind="unserved"] .concern-name', /^cnc\/3$/);
  await awaitText(page, '.headline h1', /1 channel needs attention/);
  assert.match(await page.title(), /^\(1\) Plant/);
  assert.match(await textOf(page, '.concern-why'), /last (instance|one)/);
  assert.match(await textOf(page, '.concern .todo'), /[Ss]tart doomed/);
  await awaitText(page, '.events li[data-event="instance ended"]', /doomed: last instance ended/);
  await awaitText(page, '.strip tr[data-level="act"] .cell-name', /doomed/);
  await page.reload();
  await awaitText(page, '.events li[data-event="instance ended"]', /doomed: last instance ended/);
  await awaitText(page, '.concern[data-kind="unserved"] .concern-why', /last (instance|one)/);
  await picture(page, 'unserved');
  await plant.withdraw(3);
  await page.waitForSelector('[data-channel="cnc/3"][data-state="idle"]');
  // Its service is still lost; one that leaves is not.
  await awaitText(page, '.headline h1', /1 problem/);
  const again = await plant.squareRoot('--name', 'doomed', '--uuid', '9d2b7c55-4e1f-4a53-8f0e-6a1f0c3b2d10');
  await awaitText(page, '.headline h1', /All is well/);
  await again.stop();
  await awaitText(page, '.events li[data-event="instance ended"]', /doomed: last instance ended/);
  await awaitText(page, '.headline h1', /All is well/);
  await page.close();
});

test('a message queue is shown with its machine, its service and how far it is filled', async () => {
  const other = await Plant.start();
  try {
    const config = other.file('cnc.textproto', `system_data { name: "ALARMS" type: STRING elements: 9 }
      system_data { name: "CONTROL" member { name: "LastFilled" } member { name: "LastGet" } }\n`);
    const program = other.file('alarms.nc', 'SSDQInit[SD.CONTROL]\nSSDQ[SD.ALARMS, SD.CONTROL, "drill worn"]\n#FLUSH WAIT\nM30\n');
    await other.cnc('--config', config, '--run', `1=${program}`);
    await other.configuredGateway(`queue { name: "ALARMS" control: "SD.CONTROL" drain: WHEN_ANSWERED uuid: "${slowUuid}" }`);
    const { url } = await other.web();
    const page = await browser.open(url, { view: '#/plant' });
    const queue = '[data-machine="cnc"] [data-channel="cnc.ALARMS/1"]';
    await page.waitForSelector(`${queue}[data-state="unserved"]`);
    await awaitText(page, `${queue} .channel-number`, /^ALARMS$/);
    assert.equal(await page.$('[data-machine="cnc.ALARMS"]'), null);
    // It appears after a pause: a program and its service may start together.
    await page.waitForFunction(() => document.querySelector('main').textContent.includes('cnc.ALARMS/1'), { polling: 50 });
    await picture(page, 'queue');
    await page.goto(`${url}/#/data?machine=cnc.ALARMS`);
    await awaitText(page, 'tr[data-variable="1/queue/waiting"] .cell-value', /^1$/);
    await other.slowService({ seconds: 0 });
    await awaitText(page, 'tr[data-variable="1/queue/waiting"] .cell-value', /^0$/);
    await awaitText(page, 'tr[data-variable="1/queue/response"] .cell-value', /drill worn/);
    await picture(page, 'queue-data');
    await page.close();
  } finally {
    await other.stop();
  }
});

test('without data or programs there is no view of them', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await page.waitForSelector('.machine');
  assert.equal(await page.$eval('[data-tab="data"]', (node) => node.hidden), true);
  await page.close();
});

test('without permission to act there is no button that acts, and no login', async () => {
  const page = await browser.open(web.url, { view: '#/services' });
  await awaitText(page, '.service-name', /root one|square/);
  assert.deepEqual(await page.$$eval('[data-action], .account button', (all) => all.length), 0);
  await page.close();
});

test('the page is in German for a German browser', async () => {
  const page = await browser.open(web.url, { view: '#/plant', language: 'de-CH' });
  await awaitText(page, '.headline h1', /Alles in Ordnung/);
  assert.equal(await page.evaluate(() => document.documentElement.lang), 'de');
  await page.close();
});

test('the keyboard reaches each view, and a call opens with it', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  const active = () => page.evaluate(() => document.activeElement.textContent);
  await page.keyboard.press('Tab');
  assert.match(await active(), /Skip to content/);
  await page.keyboard.press('Tab');
  await page.keyboard.press('Tab');
  await page.keyboard.press('Tab');
  assert.match(await active(), /Calls/);
  await page.keyboard.press('Enter');
  await awaitText(page, 'h1', /^Calls$/);
  await page.waitForSelector('tr[data-call] a');
  await page.focus('tr[data-call] a');
  await page.keyboard.press('Enter');
  await awaitText(page, 'h1', /^Call .+-\d+$/);
  assert.match(await active(), /^Call /);
  await page.close();
});

test('the wall shows the plant alone and needs no scrolling', async () => {
  const page = await browser.open(web.url, { query: '?wall', width: 1920, height: 1080, dark: true });
  await awaitText(page, '.headline h1', /All is well/);
  assert.equal(await page.$('nav.tabs'), null);
  assert.ok(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight));
  const size = await page.$eval('.headline h1', (node) => Number.parseFloat(getComputedStyle(node).fontSize));
  assert.ok(size >= 72, `${size} px are too small for three metres`);
  await picture(page, 'wall');
  await page.close();
});

test('a service is one row; it unfolds to its lines and instances, and its link unfolds it', async () => {
  const page = await browser.open(web.url, { view: '#/services' });
  const service = `.service[data-uuid="${squareRootUuid}"]`;
  await page.waitForSelector(`${service} .service-row`);
  assert.ok(await page.$$eval('.service-row:not(.service-labels)', (rows) => rows.every((row) => row.offsetHeight >= 28 && row.offsetHeight <= 36)));
  assert.ok(await page.$eval(`${service} .service-more`, (node) => node.hidden));
  await page.click(`${service} .service-toggle`);
  await page.waitForSelector(`${service} .plot-field .plot-line[d^=M]`);
  await page.waitForSelector(`${service} tr[data-instance]`);
  assert.match(await textOf(page, `${service} .service-uuid`), new RegExp(squareRootUuid));
  await page.click(`${service} .service-toggle`);
  await page.waitForFunction((selector) => document.querySelector(selector).hidden, {}, `${service} .service-more`);
  await page.goto(`${web.url}/#/plant`);
  await page.click(`.strip tr[data-uuid="${squareRootUuid}"] a`);
  await page.waitForSelector(`${service} tr[data-instance]`);
  await page.close();
});

test('a service shows which channel an instance has served in the last minute', async () => {
  await plant.request(2, squareRootUuid, '81');
  const page = await browser.open(web.url, { view: `#/services/${squareRootUuid}` });
  const served = '.matrix td[data-served="yes"][data-label="cnc/2"]';
  await awaitText(page, served, /^(<0\.1|0\.\d)$/);
  assert.match(await textOf(page, '.matrix tbody th'), /^root one \S+:\d+$/);
  await awaitText(page, '.capacity', /^One more instance would not help: \d+ % busy/);
  await picture(page, 'matrix');
  await page.close();
});

for (const [view, ready] of [['plant', '.machine'], [`services/${squareRootUuid}`, '.plot-field .plot-line[d^=M]'], ['calls', 'tr[data-call]'], ['doctor', '.finding']]) {
  for (const dark of [false, true]) {
    const [name] = view.split('/');
    test(`axe finds nothing in the view ${name}, ${dark ? 'dark' : 'light'}`, async () => {
      const page = await browser.open(web.url, { view: `#/${view}`, dark });
      await page.waitForSelector(ready);
      for (const [width, height] of [[1440, 900], [1024, 768], [390, 844]]) {
        await page.setViewport({ width, height });
        assert.deepEqual(await violations(page), []);
        assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `wider than ${width} px`);
        await picture(page, `${name}-${width}-${dark ? 'dark' : 'light'}`);
      }
      await page.close();
    });
  }
}

test('recordings have their summary, their calls and their waterfalls', async () => {
  const shelf = await plant.web({ flags: ['--recordings', plant.folder] });
  const page = await browser.open(shelf.url, { view: '#/recordings' });
  const finished = await page.waitForFunction(() => [...document.querySelectorAll('.recordings tbody tr')].find((row) => row.cells[0].textContent === 'run.mcap'));
  const cells = await finished.evaluate((row) => [...row.cells].map((cell) => cell.textContent));
  assert.equal(cells[1], 'cnc');
  assert.match(`${cells[2]} ${cells[3]}`, /^\d\d:\d\d:\d\d \d\d:\d\d:\d\d$/);
  assert.ok(Number(cells[4]) >= 1, `${cells[4]} calls`);
  assert.equal(cells[5], '0');
  const writing = plant.recorder(plant.file('more.mcap'));
  await writing.ready();
  await page.reload();
  await awaitText(page, '.recordings th', /^more\.mcap\.partbeing written$/);
  assert.deepEqual(await violations(page), []);
  await page.click('.recordings th a[href$="/run.mcap"]');
  await awaitText(page, '.recording-facts', /closed/);
  await page.waitForSelector('.hops tbody tr');
  await page.waitForSelector('tr[data-call]');
  assert.deepEqual(await violations(page), []);
  await picture(page, 'recording');
  await page.click('tr[data-call] a');
  await page.waitForSelector('.steps tbody tr[data-hop="written back"]');
  await until(async () => (await page.$$('.lane')).length === 2, 'the waterfall of a recorded call');
  await page.close();
});
