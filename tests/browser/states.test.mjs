// States of an invented plant, each at three sizes, light and dark, in both languages: nothing scrolls sideways, the
// header is one row, no text is cut, and axe finds nothing. With MILLRACE_SCREENSHOTS each is a picture, for people.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { Browser, picture, violations } from './browser.mjs';
import { dataOfLathe, diagnoses, endedCalls, heldTimeline, minuteOf, plantWith, recordings, serve, uuids } from './invented.mjs';

let browser;
/** A tab for each language. */
const tabs = {};

before(async () => {
  browser = await Browser.start();
});

/** Runs `look` with a view of the page of this server, which ends then. */
async function withView(server, { language, ...options }, look) {
  const tab = tabs[language];
  if (tab) {
    await browser.show(tab, server.url, options);
  } else {
    tabs[language] = await browser.open(server.url, { ...options, language });
  }
  try {
    await look(tabs[language]);
  } finally {
    await tabs[language].goto('about:blank');
    await server.stop();
  }
}

after(() => browser?.stop());

afterEach(() => browser.expectNoComplaints());

const sizes = [[1920, 1080], [1024, 768], [390, 844]];

function take(plant) {
  plant.acknowledged = [{ cause: `unserved ${uuids.length}`, since: '', by: 'bert', note: 'a new probe is on its way', time: plant.about.time }];
}

function withMarker(plant) {
  plant.services.push({ ...plant.services[0], instance: 'f', uuid: uuids.marker, name: 'laser marker', delivery: 'at-most-once' });
}

function empty(plant) {
  Object.assign(plant, { machines: [], channels: [], services: [], events: [], totals: { ...plant.totals, calls_per_second: 0, data_groups: 0, program_channels: 0 } });
}

// State: the plant, the view, and an element that is there when the view is complete.
const states = {
  fine: { ready: '.strip' },
  gone: { machines: 6, causes: ['gone'], ready: '.concern[data-kind="gateway gone"]' },
  unserved: { causes: ['unserved'], ready: '.concern[data-kind="unserved"]' },
  held: { causes: ['held'], ready: '[data-action="answer"]' },
  'link-down': { machines: 4, causes: ['link down'], ready: '.concern[data-kind="link down"]' },
  aborted: { causes: ['aborted'], ready: '.concern[data-kind="program aborted"]' },
  many: { machines: 20, causes: 5, ready: '.concern' },
  wall: { machines: 20, causes: 5, query: '?wall', ready: '.concern', shownAt: sizes.slice(0, 2) },
  taken: { causes: 3, change: take, ready: '.concern-taken:not([hidden])' },
  empty: { change: empty, ready: '.empty:not([hidden])' },
  services: { causes: 2, view: '#/services', ready: '.service' },
  matrix: { view: `#/services/${uuids.root}`, ready: '.matrix' },
  calls: { view: '#/calls', ready: 'tr[data-call]' },
  call: { change: withMarker, view: '#/calls/5f3a9c0112d4-17', ready: '.lane[data-attempt="2"] .bar' },
  data: { view: '#/data?machine=lathe_1&span=600', ready: '.line .plot-line[d^=M]' },
  recordings: { view: '#/recordings', ready: '.recordings' },
};

/**
 * Texts that are cut without an ellipsis or lie over what follows, and tables that scroll. All in the page: `$$eval` fetches
 * a handle for each node first, which takes seconds for 2,000.
 */
const cut = (page) => page.evaluate(() => [...document.querySelectorAll('main *')].filter((node) => node.childElementCount === 0 && node.clientWidth > 1 && node.scrollWidth > node.clientWidth + 1
  && !node.closest('.for-readers, .plot-area, .lane-bars, .band-run') && getComputedStyle(node).textOverflow !== 'ellipsis'
  || node.matches('.scroll') && node.scrollWidth > node.clientWidth + 1).map((node) => `${node.className || node.tagName}: ${node.textContent}`));

/** How far the middles of what stands in the header are apart. */
const spreadOfHeader = (page) => page.$$eval('.top > *, .side > *', (parts) => {
  const middles = parts.filter((part) => part.offsetHeight > 0 && getComputedStyle(part).position !== 'fixed')
    .map((part) => (part.getBoundingClientRect().top + part.getBoundingClientRect().bottom) / 2);
  return Math.max(...middles) - Math.min(...middles);
});

for (const [name, { view = '#/plant', query, ready, change = () => {}, shownAt = sizes, ...plant }] of Object.entries(states)) {
  for (const language of ['en', 'de']) {
    test(`${name}, ${language}`, async () => {
      const snapshot = plantWith(plant);
      change(snapshot);
      const server = await serve(snapshot, minuteOf(snapshot), { ...dataOfLathe(), ...recordings(), '/api/calls': endedCalls(), '/api/calls/5f3a9c0112d4-17': heldTimeline() });
      const found = [];
      await withView(server, { view, query, language }, async (page) => {
        await page.waitForSelector(ready);
        // Without pictures one theme is enough in German.
        for (const theme of language === 'en' || process.env.MILLRACE_SCREENSHOTS ? ['light', 'dark'] : ['dark']) {
          await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: theme }]);
          await page.waitForFunction((wanted) => document.documentElement.dataset.theme === wanted, {}, theme);
          for (const [width, height] of shownAt) {
            const shown = `${name}-${language}-${theme}-${width}`;
            await page.setViewport({ width, height });
            await page.waitForFunction((wide) => innerWidth === wide, {}, width);
            await picture(page, shown, true);
            const parts = await cut(page);
            if (await page.evaluate(() => document.documentElement.scrollWidth > innerWidth)) {
              parts.push('the page');
            }
            if (await spreadOfHeader(page) > 8) {
              parts.push('a header of several rows');
            }
            // Contrast differs between the themes, structure between the sizes, nothing between the languages.
            if (language === 'en' && width === (theme === 'dark' ? 390 : 1920)) {
              parts.push(...await violations(page));
            }
            found.push(...parts.map((part) => `${shown}: ${part}`));
          }
        }
      });
      assert.deepEqual(found, []);
    });
  }
}

/** The fields whose texts others choose: programs, services, operators, and who writes on the network. */
const foreign = new Set(['name', 'description', 'version', 'host', 'machine', 'channels', 'service', 'program', 'request', 'response', 'reason', 'text',
  'detail', 'fabric', 'gateway_host', 'subject', 'why', 'gateway_version', 'by', 'note', 'user', 'group', 'machines', 'what', 'advice', 'addresses']);
const controls = '\u0007\u0085\u061c\u202e';

/** The same data, each of these texts with controls of terminals and of the direction of text. */
const withControls = (value, field) => (typeof value === 'string' ? (foreign.has(field) ? value + controls : value)
  : Array.isArray(value) ? value.map((each) => withControls(each, field))
    : value !== null && typeof value === 'object' ? Object.fromEntries(Object.entries(value).map(([name, each]) => [name, withControls(each, name)]))
      : value);

/** What a reader sees or hears. */
const shownTexts = (page) => page.evaluate(() => [document.title, document.body.textContent,
  ...[...document.querySelectorAll('[title], [aria-label]')].flatMap((node) => [node.title, node.ariaLabel ?? ''])]);

test('no view shows a control character of a foreign text', async () => {
  const found = [];
  for (const [name, { view = '#/plant', change = () => {}, query, ready, ...plant }] of Object.entries({ ...states, doctor: { view: '#/doctor', ready: '.finding' } })) {
    const snapshot = plantWith(plant);
    change(snapshot);
    const more = { ...recordings(), '/api/calls': endedCalls(), '/api/calls/5f3a9c0112d4-17': heldTimeline(), '/api/doctor': diagnoses() };
    const server = await serve(withControls(snapshot), minuteOf(snapshot), { ...dataOfLathe(), ...withControls(more) });
    await withView(server, { view, query, language: 'en' }, async (page) => {
      await page.waitForSelector(ready);
      const texts = await shownTexts(page);
      assert.ok(name === 'empty' || texts.some((text) => text.includes('\\x07\\x85\\u061c\\u202e')), name);
      found.push(...texts.filter((text) => /[\p{Cc}\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]/u.test(text)).map((text) => `${name}: ${JSON.stringify(text)}`));
    });
  }
  assert.deepEqual(found, []);
});
