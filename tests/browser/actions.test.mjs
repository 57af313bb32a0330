// Actions on the page: only for authorized users, only after a question that names channel, call
// and consequence, and only on the call in the question.
import assert from 'node:assert/strict';
import { after, afterEach, before, test } from 'node:test';
import { awaitText, Browser, picture, textOf, violations } from './browser.mjs';
import { Plant, slowUuid, squareRootUuid, until } from './plant.mjs';

const plant = await Plant.start();
let browser;
let web;
let flags;
let cnc;
let gateway;

const program = `%held
N10 V.G.SERVICE.UUID = "${slowUuid}"
N20 V.G.SERVICE.REQUEST = "turn the table"
N30 V.G.SERVICE.REQUEST_STATE = 1
N40 #FLUSH CONTINUE
N50 #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
N60 #MSG ["answered: state %u, %s", V.G.SERVICE.RESPONSE_STATE, V.G.SERVICE.RESPONSE]
N70 M30
`;

before(async () => {
  browser = await Browser.start();
  const slow = await plant.slowService();
  // Before the call, so that it has seen the request.
  flags = ['--allow-actions', await plant.users('anna', 'a good password'), '--state-folder', plant.file('state')];
  web = await plant.web({ flags });
  cnc = await plant.cnc('--run', `1=${plant.file('held.nc', program)}`, '--exit-when-idle');
  gateway = await plant.gateway();
  const page = await browser.open(web.url);
  await page.waitForSelector('[data-channel="cnc/1"][data-state="running"]');
  await slow.stop('SIGKILL');
  await page.close();
});

after(async () => {
  await browser?.stop();
  await plant.stop();
});

afterEach(() => {
  // The browser logs each status 401 to its console.
  const complaints = browser.complaints.filter((each) => !/status of 401/.test(each));
  browser.complaints = [];
  assert.deepEqual(complaints, []);
});

async function logIn(page, password) {
  await page.waitForSelector('dialog input[name="user"]');
  await page.$eval('dialog input[name="user"]', (input) => (input.value = ''));
  await page.type('dialog input[name="user"]', 'anna');
  await page.type('dialog input[name="password"]', password);
  await page.click('dialog [data-confirm]');
}

const cardButton = (page, channel, button) => page.waitForFunction((name, selector) => [...document.querySelectorAll('.concern[data-kind="held"]')]
  .find((each) => each.querySelector('.concern-name').textContent === name)?.querySelector(selector), {}, channel, button);

test('a blocked call comes first, with what to do', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await awaitText(page, '.concern[data-kind="held"] .concern-name', /^cnc\/1$/);
  await awaitText(page, '.headline h1', /1 channel needs attention/);
  assert.match(await textOf(page, '.concern .who'), /Operator/);
  assert.match(await textOf(page, '.concern .reason'), /exited during this call, which may run only once/);
  assert.match(await textOf(page, '.concern-subject'), /turn the table/);
  assert.deepEqual(await violations(page), []);
  await picture(page, 'held');
  await page.close();
});

test('a wall has no actions', async () => {
  const page = await browser.open(web.url, { query: '?wall', dark: true, width: 1920, height: 1080 });
  await awaitText(page, '.concern-name', /^cnc\/1$/);
  assert.equal((await page.$$('[data-action], .account button')).length, 0);
  assert.ok(await page.evaluate(() => document.documentElement.scrollHeight <= innerHeight));
  assert.deepEqual(await violations(page), []);
  await picture(page, 'wall-held');
  await page.close();
});

test('a wrong password is reported and has no effect', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await page.waitForSelector('.account button');
  await page.click('.account button');
  await logIn(page, 'guess');
  await awaitText(page, '.dialog-said[data-kind="refused"]', /./);
  assert.deepEqual(await violations(page), []);
  await page.keyboard.press('Escape');
  await page.waitForFunction(() => !document.querySelector('dialog'));
  assert.match(await textOf(page, '.account'), /Log in/);
  await page.close();
});

for (const language of ['en', 'de']) {
  test(`the header has one row at 1440 px, with every view and the login, in ${language}`, async () => {
    const page = await browser.open(web.url, { view: '#/plant', language, width: 1440, height: 900 });
    await page.waitForSelector('.account button');
    await page.$$eval('.tabs a', (tabs) => tabs.forEach((tab) => { tab.hidden = false; }));
    const middles = await page.$$eval('.top > *, .side > *, .tabs > *', (parts) => parts.filter((part) => part.offsetHeight > 0).map((part) => {
      const { top, bottom } = part.getBoundingClientRect();
      return Math.round((top + bottom) / 2);
    }));
    assert.ok(Math.max(...middles) - Math.min(...middles) <= 8, `middles of its parts: ${middles}`);
    await page.close();
  });
}

test('an acknowledged cause is shown on every page with user, time and note', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await (await cardButton(page, 'cnc/1', '[data-action="acknowledge"]')).click();
  await logIn(page, 'a good password');
  await page.waitForSelector('dialog input[name="note"]');
  assert.deepEqual(await violations(page), []);
  await picture(page, 'acknowledge');
  await page.type('dialog input[name="note"]', 'fetching a new part');
  await page.click('dialog [data-confirm]');
  await page.waitForFunction(() => !document.querySelector('dialog'));
  const taken = [/^Taken by anna, \d\d:\d\d:\d\d · fetching a new part$/, /^cnc\/1: taken by anna: fetching a new part$/];
  const other = await browser.open(web.url, { view: '#/plant' });
  for (const each of [page, other]) {
    await awaitText(each, '.concern[data-kind="held"] .concern-taken', taken[0]);
    await awaitText(each, '.events li[data-event="acknowledged"] .event-what', taken[1]);
  }
  assert.equal(await page.$('[data-action="acknowledge"]'), null, 'nobody takes twice what is his');
  await other.waitForSelector('[data-action="acknowledge"]');
  await picture(page, 'acknowledged');
  await page.close();
  await other.close();
});

test('an acknowledgement stays when the server restarts, and ends with its cause', async () => {
  const unknown = '7c9e6679-7425-40de-944b-e07fc1f90ae7';
  const card = '.concern[data-kind="unserved"]';
  const restart = async () => {
    await web.stop('SIGKILL');
    web = await plant.web({ port: web.port, flags });
  };
  const page = await browser.open(web.url, { view: '#/plant' });
  await plant.request(3, unknown, 'one');
  await page.waitForSelector(`${card} [data-action="acknowledge"]`);
  await page.click(`${card} [data-action="acknowledge"]`);
  await logIn(page, 'a good password');
  await page.waitForSelector('dialog input[name="note"]');
  await page.type('dialog input[name="note"]', 'on my way');
  await page.click('dialog [data-confirm]');
  await awaitText(page, `${card} .concern-taken`, /on my way/);

  await restart();
  const other = await browser.open(web.url, { view: '#/plant' });
  await awaitText(other, `${card} .concern-taken`, /^Taken by anna, \d\d:\d\d:\d\d · on my way$/);
  await awaitText(other, '.concern[data-kind="held"] .concern-taken', /fetching a new part/);
  await awaitText(other, '.events li[data-event="acknowledged"] .event-what', /^cnc\/3: taken by anna: on my way$/);

  await plant.withdraw(3);
  await other.waitForFunction((selector) => !document.querySelector(selector), {}, card);
  await restart();
  await plant.request(3, unknown, 'two');
  const third = await browser.open(web.url, { view: '#/plant' });
  await third.waitForSelector(card);
  assert.ok(await third.$eval(`${card} .concern-taken`, (node) => node.hidden));
  await plant.withdraw(3);
  await third.waitForFunction((selector) => !document.querySelector(selector), {}, card);
  browser.forgetUnreachable();
  for (const each of [page, other, third]) {
    await each.close();
  }
});

test('a blocked call that is retried through the page is run again', async () => {
  const lost = await plant.slowService();
  const page = await browser.open(web.url, { view: '#/plant' });
  await plant.request(2, slowUuid, 'once more');
  await page.waitForSelector('[data-channel="cnc/2"][data-state="running"]');
  await lost.stop('SIGKILL');
  await page.waitForSelector('[data-channel="cnc/2"][data-state="held"]');
  // The button stays while its card changes.
  const retry = await cardButton(page, 'cnc/2', '[data-action="retry"]');
  await awaitText(page, '.concern[data-kind="held"] .concern-advice', /no running instance/);
  const next = await plant.slowService({ seconds: 0 });
  await page.waitForFunction((button) => !/no running instance/.test(button.closest('.concern').querySelector('.concern-why').textContent), {}, retry);
  await retry.click();
  await logIn(page, 'a good password');
  await awaitText(page, 'dialog', /Retry the call of cnc\/2\?[\s\S]*it runs twice/);
  await page.click('dialog [data-confirm]');
  await page.waitForSelector('.dialog-said[data-kind]');
  assert.match(await textOf(page, '.dialog-said'), /Done/);
  const call = await until(async () => (await (await fetch(`${web.url}/api/calls`)).json()).calls.find((each) => each.request === 'once more'), 'the answer');
  assert.equal(call.response, 'once more');
  assert.equal(call.attempt, 2);
  await page.goto(`${web.url}/#/calls/${call.call}`);
  await page.reload();
  await page.waitForSelector('.lane[data-attempt="2"]');
  assert.deepEqual(await page.$$eval('.lane', (lanes) => lanes.map((lane) => lane.dataset.attempt)), ['0', '1', '2']);
  await next.stop();
  await page.close();
});

test('an instance that is drained through the page leaves', async () => {
  const root = await plant.squareRoot('--name', 'leaving');
  const page = await browser.open(web.url, { view: `#/services/${squareRootUuid}` });
  await page.waitForSelector('[data-open="true"] [data-action="drain"]');
  await page.click('[data-open="true"] [data-action="drain"]');
  await logIn(page, 'a good password');
  await awaitText(page, 'dialog', /Drain leaving\?[\s\S]*otherwise start it by hand[\s\S]*last instance of its service/);
  assert.ok(!root.hasEnded);
  await page.click('dialog [data-confirm]');
  await awaitText(page, '.dialog-said[data-kind="done"]', /Done/);
  await until(() => root.hasEnded, 'the end of the drained instance');
  await page.click('dialog button');
  await awaitText(page, 'tr[data-state="gone"] .instance-name', /leaving/);
  await page.close();
});

test('a question about a call that is over sends nothing', async () => {
  const lost = await plant.slowService();
  const page = await browser.open(web.url, { view: '#/plant' });
  await plant.request(3, slowUuid, 'never mind');
  await page.waitForSelector('[data-channel="cnc/3"][data-state="running"]');
  await lost.stop('SIGKILL');
  await (await cardButton(page, 'cnc/3', '[data-action="retry"]')).click();
  await logIn(page, 'a good password');
  await awaitText(page, 'dialog h2', /cnc\/3/);
  await plant.withdraw(3);
  await page.waitForSelector('[data-channel="cnc/3"][data-state="idle"]');
  await page.click('dialog [data-confirm]');
  await awaitText(page, '.dialog-said[data-kind="refused"]', /no longer pending/);
  await page.close();
});

test('a blocked call that is answered through the page ends the program', async () => {
  const page = await browser.open(web.url, { view: '#/plant' });
  await page.waitForSelector('.concern[data-kind="held"] [data-action="answer"]');
  await page.click('[data-action="answer"]');
  await logIn(page, 'a good password');
  await page.waitForSelector('dialog input[name="response"]');
  const question = await textOf(page, 'dialog');
  const held = (await (await fetch(`${web.url}/api/channels`)).json()).find((each) => each.channel_state === 'held');
  assert.match(question, /cnc\/1/);
  assert.ok(question.includes(held.call), `${question} names ${held.call}`);
  assert.match(question, /the machine may move/);
  assert.deepEqual(await violations(page), []);
  await picture(page, 'answer');
  // Without a state nothing is sent.
  await page.type('dialog input[name="response"]', 'turned by hand');
  await page.click('dialog [data-confirm]');
  assert.ok(await page.$('dialog input:invalid'));
  await page.type('dialog input[name="state"]', '1');
  await page.click('dialog [data-confirm]');
  await awaitText(page, '.dialog-said[data-kind="done"]', /Done/);
  await until(() => cnc.hasEnded, 'the end of the program');
  assert.equal(await cnc.ended, 0);
  assert.match(cnc.output, /answered: state 1, turned by hand/);
  await page.click('dialog button');
  await page.waitForFunction(() => !document.querySelector('.concern[data-kind="held"]'));
  await page.close();
});

test('what a German reader acknowledges has its English name for an English one, also after a restart', async () => {
  const recorder = await plant.recorder(plant.file('killed.mcap')).ready();
  const { pid } = recorder.child;
  const names = { de: `auf \\S+, Prozess ${pid}`, en: `on \\S+, pid ${pid}` };
  const taken = { de: 'übernommen von anna', en: 'taken by anna' };
  const page = await browser.open(web.url, { view: '#/plant', language: 'de' });
  await recorder.stop('SIGKILL');
  const card = '.concern[data-kind="process gone"]';
  await awaitText(page, `${card} .concern-name`, new RegExp(`${names.de}$`));
  await page.click(`${card} [data-action="acknowledge"]`);
  await logIn(page, 'a good password');
  await page.waitForSelector('dialog input[name="note"]');
  await page.click('dialog [data-confirm]');
  const event = '.events li[data-event="acknowledged"] .event-what';
  await awaitText(page, event, new RegExp(`${names.de}: ${taken.de}$`));
  await web.stop('SIGKILL');
  web = await plant.web({ port: web.port, flags });
  for (const language of ['en', 'de']) {
    const other = await browser.open(web.url, { view: '#/plant', language });
    await awaitText(other, event, new RegExp(`${names[language]}: ${taken[language]}$`));
    await other.close();
  }
  browser.forgetUnreachable();
  await page.close();
});

test('a machine whose gateway is gone is forgotten on all pages, until it is reported again', async () => {
  await plant.cnc();
  await gateway.stop('SIGKILL');
  gateway = await plant.gateway();
  const [page, other] = [await browser.open(web.url, { view: '#/plant' }), await browser.open(web.url, { view: '#/plant', language: 'de' })];
  await page.waitForSelector('[data-channel="cnc/1"][data-state="idle"]');
  await gateway.stop('SIGKILL');
  const card = '.concern[data-kind="gateway gone"]';
  await page.waitForSelector(`${card} [data-action="forget"]`);
  await page.click(`${card} [data-action="forget"]`);
  await logIn(page, 'a good password');
  await awaitText(page, 'dialog h2', /^Forget cnc\?$/);
  await page.click('dialog [data-confirm]');
  for (const each of [page, other]) {
    await each.waitForFunction((selector) => !document.querySelector(selector) && !document.querySelector('.machine'), {}, card);
  }
  await awaitText(page, '.events li[data-event="machine forgotten"]', /cnc: forgotten by anna$/);
  await awaitText(other, '.events li[data-event="machine forgotten"]', /cnc: vergessen von anna$/);
  gateway = await plant.gateway();
  await page.waitForSelector('[data-channel="cnc/1"][data-state="idle"]');
  await page.close();
  await other.close();
});
