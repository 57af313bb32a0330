// What the views show on an invented plant; a wall screen needs no scrolling.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { awaitText, Browser, picture, textOf, violations } from './browser.mjs';
import { dataOfLathe, diagnoses, heldTimeline, historyOf, plantWith, recordedTimeline, recordings, serve, uuids } from './invented.mjs';

let browser;

before(async () => {
  browser = await Browser.start();
});

after(() => browser?.stop());

afterEach(() => browser.expectNoComplaints());

/** Who serves whom on the invented plant, and how busy each is. */
const served = [['a', 'lathe_1', 2, 4.7], ['a', 'mill_2', 1, 0.6], ['a', 'mill_2', 2, 4.6], ['b', 'lathe_1', 2, 4.6], ['b', 'mill_2', 2, 4.7], ['c', 'lathe_1', 1, 1.1]];
const quiet = { a: 0.03, b: 0.03, c: 0 };

/** Runs `look` with a page on an invented plant. */
async function withPage({ history = historyOf(served, quiet), change = () => {}, more = {}, ...plant }, options, look) {
  const snapshot = plantWith(plant);
  change(snapshot);
  const server = await serve(snapshot, history, more);
  const page = await browser.open(server.url, options);
  try {
    await look(page, server);
  } finally {
    await page.close();
    await server.stop();
  }
}

test('nothing moves under a pressed pointer for five seconds, and the click is not lost', async () => {
  await withPage({ machines: 8, causes: 4 }, { view: '#/plant' }, async (page, server) => {
    const { concerns } = plantWith({ machines: 8, causes: 4 });
    const other = await browser.open(server.url, { view: '#/plant' });
    const first = (where, kind) => where.waitForSelector(`.concern[data-kind="${kind}"]:first-child`);
    const changeUnderThePointer = async () => {
      const at = await (await page.waitForSelector('.concern[data-kind="held"]:first-child [data-action="retry"]')).clickablePoint();
      await page.mouse.move(at.x, at.y);
      await page.mouse.down();
      server.change({ concerns: [...concerns.slice(1), concerns[0]] });
      await first(other, concerns[1].kind);
    };
    await page.evaluate(() => { performance.now = () => 0; });
    await changeUnderThePointer();
    await first(page, 'held');
    await page.evaluate(() => { performance.now = () => 5000; });
    await first(page, concerns[1].kind);
    await page.mouse.move(0, 0);
    await page.mouse.up();
    server.change({ concerns });
    await first(other, 'held');
    await changeUnderThePointer();
    await page.mouse.up();
    await awaitText(page, 'dialog h2', /mill_2\/3/);
    await first(page, concerns[1].kind);
    await other.close();
  });
});

const isTooWide = (page) => page.evaluate(() => document.documentElement.scrollWidth > innerWidth);

for (const language of ['en', 'de']) {
  test(`a wall with five causes and twenty machines needs no scrolling, ${language}`, async () => {
    await withPage({ machines: 20, causes: 5 }, { query: '?wall', language, dark: true, width: 1920, height: 1080 }, async (page) => {
      assert.equal((await page.$$('.concern')).length, 5);
      assert.equal((await page.$$('.machine')).length, 20);
      assert.ok(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight));
      assert.ok(!await isTooWide(page));
      // Each card names its subject and the reason.
      assert.ok(await page.$$eval('.concern', (cards) => cards.every((card) => card.querySelector('.concern-why').textContent.length > 20)));
      await picture(page, `wall-many-${language}`);
    });
  });
}

test('a service shows which instance serves which channel, how busy each is, and that one more would not help', async () => {
  await withPage({}, { view: `#/services/${uuids.root}` }, async (page) => {
    await page.waitForSelector('.matrix');
    assert.deepEqual(await page.$$eval('.matrix thead th', (cells) => cells.map((cell) => cell.textContent)),
      ['Instance', 'lathe_1', 'mill_2', 'Busy, 1 min', '1', '2', '1', '2']);
    assert.deepEqual(await page.$$eval('.matrix tbody tr', (rows) => rows.map((row) => [...row.cells].map((each) => each.textContent))), [
      ['square root A vm:31768', '·', '4.7', '0.6', '4.6', '3 %'],
      ['square root B vm:31770', '·', '4.6', '·', '4.7', '3 %'],
      ['square root lathe vm:31775', '1.1', '·', '–', '–', '0 %']]);
    assert.equal(await textOf(page, '.capacity'), 'One more instance would not help: 2 % busy in the last minute, no calls waiting.');
    assert.deepEqual(await violations(page), []);
  });
});

test('one more instance would help where calls wait, also in German', async () => {
  const change = (plant) => Object.assign(plant.channels.find((each) => each.machine === 'mill_2' && each.channel === 1), {
    channel_state: 'waiting', uuid: uuids.root, since: new Date(Date.now() - 4000).toISOString().replace('Z', '000Z'),
  });
  await withPage({ history: historyOf(served, { a: 1, b: 1, c: 1 }), change }, { view: `#/services/${uuids.root}`, language: 'de' }, async (page) => {
    await awaitText(page, '.capacity[data-advice="waiting"]', /^Eine weitere Instanz würde helfen: 1 Aufruf wartet\.$/);
    await picture(page, 'matrix-waiting-de');
  });
});

test('an acknowledged cause shows user, time and note, also on a wall', async () => {
  const change = (plant) => {
    const time = new Date().toISOString().replace('Z', '000Z');
    plant.acknowledged = [{ cause: `unserved ${uuids.length}`, since: '', by: 'bert', note: 'a new probe is on its way', time }];
  };
  await withPage({ causes: 3, change }, { view: '#/plant' }, async (page) => {
    await awaitText(page, '.concern[data-kind="unserved"] .concern-taken', /^Taken by bert, \d\d:\d\d:\d\d · a new probe is on its way$/);
    assert.equal((await page.$$('.concern-taken:not([hidden])')).length, 1);
  });
  await withPage({ causes: 5, machines: 20, change }, { query: '?wall', dark: true, width: 1920, height: 1080 }, async (page) => {
    await awaitText(page, '.concern-taken', /^Taken by bert/);
    assert.ok(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight));
    assert.deepEqual(await violations(page), []);
    await picture(page, 'taken-wall');
  });
});

test('a call that was blocked for minutes shows its other steps, with names and links, and its steps can be copied', async () => {
  const more = { '/api/calls/5f3a9c0112d4-17': heldTimeline(), ...recordings() };
  const withMarker = (plant) => plant.services.push({ ...plant.services[0], instance: 'f', uuid: uuids.marker, name: 'laser marker', delivery: 'at-most-once' });
  for (const language of ['en', 'de']) {
    await withPage({ change: withMarker, more }, { view: '#/calls/5f3a9c0112d4-17', language, dark: language === 'de' }, async (page) => {
      await page.waitForSelector('.lane[data-attempt="2"] .bar');
      // The handler that ran for less than a second is visible next to minutes of waiting.
      assert.ok(await page.$eval('.lane[data-attempt="2"] .bar[data-part="work"]', (bar) => bar.offsetWidth > 100));
      assert.equal((await page.$$('.bar[data-broken]')).length, 1);
      assert.match(await textOf(page, '.bar[data-broken]'), /7 min 09 s/);
      assert.equal(await textOf(page, `.call-facts a[href="#/services/${uuids.marker}"]`), 'laser marker');
      assert.equal(await textOf(page, '.call-facts a[href="#/data?machine=mill_2"]'), 'mill_2');
      await page.waitForSelector('.call-facts a[href^="#/recordings"]');
      assert.deepEqual(await page.$$eval('.call-facts a[href^="#/recordings"]', (links) => links.map((link) => link.textContent)), ['2026-11-27_shift_1.mcap.part']);
      await page.evaluate(() => { navigator.clipboard.writeText = async (text) => { globalThis.copied = text; }; });
      await page.click('.copy');
      await awaitText(page, '.copy', language === 'en' ? /^Copied$/ : /^Kopiert$/);
      const copied = await page.evaluate(() => globalThis.copied);
      assert.match(copied, new RegExp(`^5f3a9c0112d4-17 mill_2/3 ${uuids.marker}\n`));
      assert.equal(copied.split('\n').length, 11);
      assert.match(copied, language === 'en' ? /written back\t“ok” state 1$/ : /zurückgeschrieben\t„ok“ Zustand 1$/);
    });
  }
});

for (const [what, view, ready] of [['a recorded call', '#/recordings/shift_1.mcap/5f3a9c0112d4-17', '.steps'], ['diagnostics', '#/doctor', '.finding']]) {
  test(`in German, ${what} has no English sentence`, async () => {
    const more = { '/api/recordings/shift_1.mcap/calls/5f3a9c0112d4-17': recordedTimeline(), '/api/doctor': diagnoses(), ...recordings() };
    for (const language of ['de', 'en']) {
      await withPage({ more }, { view, language }, async (page) => {
        await page.waitForSelector(ready);
        // Lines with a word that only English has; names of files are English.
        const lines = await page.$eval('main', (main) => main.innerText.replace(/docs\/\S+/g, '').split('\n').filter((line) => /\b(the|is|are|has|of|and|this|with|to|not|on|at)\b/i.test(line)));
        assert.doesNotMatch(await textOf(page, 'main'), /`/, 'commands are code');
        if (language === 'en') {
          assert.ok(lines.length > 5, 'the words are those of the English page');
        } else {
          assert.deepEqual(lines, []);
          assert.deepEqual(await page.$$eval('main [lang=en]', (nodes) => nodes.map((node) => node.textContent)), []);
        }
        await picture(page, `${ready.slice(1)}-${language}`, true);
      });
    }
  });
}

test('values are drawn with words for states, and what a reader draws over with the mouse is shown alone', async () => {
  await withPage({ more: dataOfLathe() }, { view: '#/data?machine=lathe_1&span=600' }, async (page) => {
    const state = '.line[data-variable="1/fast/state"]';
    await page.waitForSelector(`${state} .plot-line[d^=M]`);
    assert.equal(await textOf(page, `${state} strong`), 'error (6)');
    assert.equal(await textOf(page, 'tr[data-variable="1/fast/state"] .cell-value'), 'error (6)');
    const axisOf = (name) => page.$$eval(`.line[data-variable="1/fast/${name}"] .plot-y`, (labels) => labels.map((label) => label.textContent.trim()).filter(Boolean));
    assert.deepEqual(await axisOf('state'), ['–', 'deselected', 'selected', 'ready', 'active', 'hold', 'error']);
    assert.deepEqual(await axisOf('V.E.READY'), ['FALSE', 'TRUE']);
    const area = await (await page.$(`${state} .plot-field`)).boundingBox();
    const middle = area.y + area.height / 2;
    await page.mouse.move(area.x + area.width / 2, middle);
    await page.mouse.down();
    await page.mouse.move(area.x + area.width * 0.75, middle, { steps: 4 });
    await picture(page, 'data-zooming');
    await page.mouse.up();
    await page.waitForFunction(() => /zoom=\d+-\d+/.test(location.hash));
    const [from, to] = (await page.evaluate(() => location.hash)).match(/zoom=(\d+)-(\d+)/).slice(1).map(Number);
    assert.ok(to - from > 120_000 && to - from < 200_000, `${to - from} ms of 600 s`);
    await picture(page, 'data-zoomed');
    const address = await page.evaluate(() => location.hash);
    await page.reload();
    await page.waitForSelector(`${state} .plot-line[d^=M]`);
    assert.equal(await page.evaluate(() => location.hash), address, 'the link shows the same');
    await page.click('.filter button');
    await page.waitForFunction(() => !location.hash.includes('zoom'));
  });
});

test('one green line shows that there is no problem, and nothing else comes before the machines', async () => {
  await withPage({}, { view: '#/plant' }, async (page) => {
    assert.equal(await page.$eval('.headline', (node) => node.dataset.level), 'fine');
    assert.equal(await textOf(page, '.headline h1'), 'All is well');
    assert.equal((await textOf(page, '.headline-sum')).replaceAll('\u00a0', ' '), '2/2 links · 7/7 channels ok · 20 calls/s');
    assert.ok(await page.$eval('.headline', (node) => node.offsetHeight <= 60));
    assert.ok(await page.$eval('.attention', (node) => node.hidden));
  });
});

test('a gateway that is gone with two machines is one card, with its host and process', async () => {
  await withPage({ machines: 6, causes: 5 }, { view: '#/plant' }, async (page) => {
    assert.equal(await textOf(page, '.headline h1'), '5 problems');
    const [gone, ...others] = await page.$$eval('.concern[data-kind="gateway gone"]', (cards) => cards.map((card) => card.textContent));
    assert.deepEqual(others, []);
    assert.match(gone, /press_5, press_6.*hall-3, pid 31766.*Restart the gateway on hall-3/s);
    const height = await page.$$eval('.concern', (cards) => Math.max(...cards.map((card) => card.offsetHeight)));
    assert.ok(height <= 150, `a card of ${height} px is not compact`);
  });
});

test('channels that wait for the same service are one card, with what its last instance was', async () => {
  await withPage({ causes: 2 }, { view: '#/plant' }, async (page) => {
    const [card, ...others] = await page.$$eval('.concern[data-kind="unserved"]', (cards) => cards.map((each) => each.textContent));
    assert.deepEqual(others, []);
    assert.match(card, /lathe_1\/3.*tool length.*T3 check.*also waiting: lathe_1\/4.*last instance was tool length, pid 7898 on vm/s);
  });
});

test('a row of a machine has the NC program, then the call and its service', async () => {
  await withPage({ causes: 3 }, { view: '#/plant' }, async (page) => {
    const rowOf = (channel) => page.$eval(`[data-channel="${channel}"]`, (row) => [...row.children].filter((cell) => cell.offsetWidth > 0).map((cell) => cell.textContent.trim()));
    assert.deepEqual((await rowOf('lathe_1/2')).slice(0, 4), ['2', 'pallet_shuttle', 'runningsquare root', '9.3/s']);
    assert.deepEqual((await rowOf('mill_2/1')).slice(0, 2), ['1', 'fixture_wrong · aborted, error 455']);
    assert.match((await rowOf('mill_2/3'))[2], /^heldlaser marker “part 4711”/);
  });
});

test('services with problems come first, and events have what happened, the newest first', async () => {
  await withPage({ causes: 3 }, { view: '#/plant' }, async (page) => {
    assert.deepEqual(await page.$$eval('.strip tbody th', (cells) => cells.map((cell) => cell.textContent)), ['laser marker', 'tool length', 'square root', 'dial gauge']);
    assert.deepEqual(await page.$$eval('.event-what', (events) => events.map((event) => event.textContent)), [
      'tool length: last instance ended (vm:7898)', 'mill_2/3: call of laser marker held for an operator', 'laser marker: last instance ended (vm:31802)',
      'mill_2/1: NC program fixture_wrong.nc aborted, error 455', 'square root A: instance started (vm:31768)']);
  });
});

const namesOfServices = (page) => page.$$eval('.service-name', (names) => names.map((name) => name.textContent));
const namesOfMachines = (page) => page.$$eval('.machine-name', (names) => names.map((name) => name.textContent));

for (const language of ['en', 'de']) {
  test(`services are searched and sorted by keyboard, and the address shows the same, ${language}`, async () => {
    const change = (plant) => plant.services.push(...[['g', 'grinder', 3], ['h', 'heater', 30]].map(([id, name, rate]) => ({
      ...plant.services[0], instance: id, uuid: `0000000${id}`, name, host: `hall-${id}`, calls_per_second: rate,
    })));
    await withPage({ change }, { view: '#/services', language }, async (page) => {
      await page.waitForSelector('.service');
      await page.focus('[data-sort="rate"]');
      await page.keyboard.press('Enter');
      await page.waitForSelector('[role="columnheader"][aria-sort="descending"] [data-sort="rate"]');
      assert.deepEqual(await namesOfServices(page), ['heater', 'square root', 'grinder', 'dial gauge']);
      assert.equal(await page.evaluate(() => location.hash), '#/services?sort=-rate');
      await page.keyboard.press('Space');
      await page.waitForSelector('[aria-sort="ascending"] [data-sort="rate"]');
      assert.deepEqual(await namesOfServices(page), ['dial gauge', 'grinder', 'square root', 'heater']);
      assert.equal((await page.$$('[aria-sort]')).length, 1);
      await page.type('input[type="search"]', 'HALL-');
      await page.waitForFunction(() => location.hash === '#/services?text=HALL-&sort=rate');
      assert.deepEqual(await namesOfServices(page), ['grinder', 'heater']);
      assert.deepEqual(await violations(page), []);
      await picture(page, `services-found-${language}`);
      await page.reload();
      await page.waitForSelector('.service');
      assert.deepEqual(await namesOfServices(page), ['grinder', 'heater']);
      await page.goBack();
      await page.waitForSelector('[aria-sort="descending"]');
      await page.goBack();
      await page.waitForFunction(() => document.querySelectorAll('.service').length === 4 && !document.querySelector('[aria-sort]'));
      await page.type('input[type="search"]', 'nothing');
      await awaitText(page, '.empty:not([hidden])', language === 'en' ? /^No matching services\.$/ : /^Keine passenden Dienste\.$/);
    });
  });

  test(`machines, channels and services are found on a plant of more than twelve machines, ${language}`, async () => {
    await withPage({ machines: 12 }, { view: '#/plant', language }, async (page) => {
      assert.equal((await page.$$('input[type="search"]')).length, 1);
      assert.ok(await page.$eval('form.filter', (form) => form.hidden), 'twelve are found without');
    });
    await withPage({ machines: 13, causes: ['held'] }, { view: '#/plant', language }, async (page) => {
      await page.type('.plant input[type="search"]', 'press_1');
      await page.waitForFunction(() => location.hash === '#/plant?text=press_1');
      await page.waitForFunction(() => document.querySelectorAll('.machine').length === 4);
      assert.deepEqual(await namesOfMachines(page), ['press_10', 'press_11', 'press_12', 'press_13']);
      assert.equal((await page.$$('.concern')).length, 1, 'a problem elsewhere is shown');
      assert.deepEqual(await violations(page), []);
      await picture(page, `plant-found-${language}`, true);
    });
    await withPage({}, { view: '#/plant?text=square%20root', language }, async (page) => {
      assert.equal(await page.$eval('input[type="search"]', (field) => field.value), 'square root');
      assert.deepEqual(await page.$$eval('.channel', (rows) => rows.map((row) => row.dataset.channel)), ['lathe_1/1', 'lathe_1/2', 'mill_2/2']);
      assert.deepEqual(await page.$$eval('.strip tbody th', (cells) => cells.map((cell) => cell.textContent)), ['square root']);
      await page.$eval('input[type="search"]', (field) => { field.value = ''; });
      await page.type('input[type="search"]', 'drill');
      await awaitText(page, '.machines-part .empty', language === 'en' ? /^No matching machines\.$/ : /^Keine passenden Maschinen\.$/);
    });
  });

  test(`the card of a phone has the time of day when its cause began, ${language}`, async () => {
    await withPage({ causes: ['held'] }, { view: '#/plant', language, width: 390, height: 844 }, async (page) => {
      const shown = await page.$eval('.concern-since', (since) => since.innerText);
      // With the date where midnight was in between.
      assert.match(shown, language === 'en' ? /^since (\d{4}-\d\d-\d\d )?\d\d:\d\d$/ : /^seit (\d{4}-\d\d-\d\d )?\d\d:\d\d$/);
      assert.deepEqual(await violations(page), []);
    });
  });

  test(`machines whose gateway is gone can be forgotten, ${language}`, async () => {
    const [button, question] = language === 'en' ? ['Forget these machines …', /^Forget press_5, press_6\?They are not shown here until a gateway reports them again/]
      : ['Diese Maschinen vergessen …', /^press_5, press_6 vergessen\?Hier erscheint nichts mehr davon, bis wieder ein Gateway darüber berichtet/];
    await withPage({ machines: 6, causes: 5, more: { '/api/actions/forget': { done: true, detail: '' } } }, { view: '#/plant', language }, async (page) => {
      await page.waitForSelector('[data-action="forget"]');
      assert.deepEqual(await page.$$eval('[data-action="forget"]', (all) => all.map((each) => each.textContent)), [button]);
      await page.click('.concern[data-kind="gateway gone"] [data-action="forget"]');
      assert.match((await textOf(page, 'dialog')).replace(/Consequence|Folge/, ''), question);
      assert.deepEqual(await violations(page), []);
      await picture(page, `forget-${language}`);
      await page.click('dialog [data-confirm]');
      await page.waitForFunction(() => !document.querySelector('dialog'));
    });
  });

  test(`the question for a response has the last one of the service, ${language}`, async () => {
    const more = { '/api/calls': { kept: 3, calls: [{ call: 'a-3', failed: true, response: 'text "x" is no number', response_state: 99 }, { call: 'a-2', end: 'withdrawn', failed: true },
      { call: 'a-1', failed: false, response: 'ok, 3 parts', response_state: 7, ended: '2026-03-01T07:00:00.5Z' }] } };
    await withPage({ causes: ['held'], more }, { view: '#/plant', language }, async (page) => {
      await (await page.waitForSelector('[data-action="answer"]')).click();
      await awaitText(page, '.last-response', language === 'en' ? /^ok, 3 parts state 7, 2026-03-01 07:00:00$/ : /^ok, 3 parts Zustand 7, 2026-03-01 07:00:00$/);
      assert.deepEqual(await violations(page), []);
      await picture(page, `answer-last-${language}`);
    });
    await withPage({ causes: ['held'] }, { view: '#/plant', language }, async (page) => {
      await (await page.waitForSelector('[data-action="answer"]')).click();
      await awaitText(page, '.last-response', /^–$/);
    });
  });
}

/** Texts that end in an ellipsis. */
const shortened = (page, selector) => page.$$eval(selector, (nodes) => nodes.filter((node) => node.clientWidth > 1 && node.scrollWidth > node.clientWidth).map((node) => node.textContent));

const manyDigits = (plant) => plant.channels.forEach((each, i) => Object.assign(each, { channel: [7, 12, 123][i % 3] + 200 * Math.floor((i % 6) / 3) }));

test('channel numbers of three digits are shown in full, however many there are', async () => {
  for (const [machines, width] of [[2, 1440], [4, 1440], [12, 1440], [2, 390], [4, 390], [12, 390]]) {
    await withPage({ machines, change: manyDigits }, { view: '#/plant', width }, async (page) => {
      assert.ok((await page.$$eval('.channel-number', (all) => all.filter((each) => each.textContent.length === 3).length)) > 2);
      assert.deepEqual(await shortened(page, '.channel-number'), [], `${machines} machines, ${width} px`);
      assert.deepEqual(await page.$$eval('.channels li', (all) => all.filter((each) => each.scrollWidth > each.clientWidth).map((each) => each.textContent)), [], `${machines} machines, ${width} px`);
      await picture(page, `digits-${machines}-${width}`, true);
    });
  }
});

test('a wall without a problem shows names in full, unless they need more room than it has', async () => {
  const change = (plant) => plant.machines.forEach((each) => {
    const name = `${each.machine}_in_hall_3_on_the_left`;
    plant.channels.filter(({ machine }) => machine === each.machine).forEach((channel) => Object.assign(channel, { machine: name, program: channel.program && { ...channel.program, name: 'housing_cover_second_side.nc' } }));
    each.machine = name;
  });
  for (const [machines, height, isFull] of [[2, 1080, true], [6, 1080, true], [20, 1080, true], [6, 520, false]]) {
    await withPage({ machines, change }, { query: '?wall', dark: true, width: 1920, height }, async (page) => {
      await picture(page, `wall-fine-${machines}-${height}`);
      const found = await shortened(page, '.machine-name, .program-name, .channel-detail, .channel-number, .link-text');
      assert.equal(found.length === 0, isFull, `${machines} machines, ${height} px: ${found}`);
      assert.equal(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight), isFull, `${machines} machines`);
    });
  }
});
