// Debian's Chromium without a screen. It collects the page's errors and each request to another
// server; the test that checks them fails for any (Browser.complaints).
//
//   const browser = await Browser.start();
//   const page = await browser.open(web.url, { view: '#/calls' });
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import puppeteer from 'puppeteer-core';

const axeSource = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const pictures = process.env.MILLRACE_SCREENSHOTS;
/** How long a test waits for a condition, ms: also on a host that other tests keep busy. */
const patience = 60_000;

export class Browser {
  /** "error: …", in the order in which they came. */
  complaints = [];
  #browser;
  /** Where the page of each tab comes from. */
  #origins = new WeakMap();

  static async start() {
    const browser = new Browser();
    browser.#browser = await puppeteer.launch({
      executablePath: '/usr/bin/chromium',
      args: [
        // Nothing leaves this host: no name is resolved, and other requests go to a proxy that does
        // not exist.
        '--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1', '--proxy-server=http://127.0.0.1:9',
        '--proxy-bypass-list=127.0.0.1', '--disable-gpu', '--force-color-profile=srgb',
        ...(process.getuid() === 0 ? ['--no-sandbox'] : []),
      ],
    });
    return browser;
  }

  /** Fails for the complaints since the last check. */
  expectNoComplaints() {
    const { complaints } = this;
    this.complaints = [];
    assert.deepEqual(complaints, []);
  }

  /**
   * A new tab at a view of the page, shown when the page has its first data; for a user of its own, or for that of the tab
   * `beside`; `without` are interfaces that the browser lacks.
   */
  async open(url, { view = '', query = '', language = 'en', dark = false, width = 1440, height = 900, beside = null, without = [] } = {}) {
    const context = beside?.browserContext() ?? await this.#browser.createBrowserContext();
    const page = await context.newPage();
    page.setDefaultTimeout(patience);
    // The language that the browser reports, as a user's settings would set it.
    await page.evaluateOnNewDocument((tag, missing) => {
      Object.defineProperty(navigator, 'languages', { get: () => [tag] });
      missing.forEach((name) => delete globalThis[name]);
    }, language, without);
    page.on('console', (message) => {
      if (['error', 'warn', 'warning'].includes(message.type())) {
        this.complaints.push(`${message.type()}: ${message.text()}`);
      }
    });
    page.on('pageerror', (error) => this.complaints.push(`error: ${error.message}`));
    page.on('dialog', (dialog) => {
      this.complaints.push(`dialog: ${dialog.message()}`);
      dialog.dismiss();
    });
    page.on('request', (request) => {
      if (new URL(request.url()).origin !== this.#origins.get(page)) {
        this.complaints.push(`request to ${request.url()}`);
      }
    });
    await this.show(page, url, { view, query, dark, width, height });
    return page;
  }

  /** A view in a tab that has shown the page of another server: a new tab takes a renderer's start, which costs more. */
  async show(page, url, { view = '', query = '', dark = false, width = 1440, height = 900 } = {}) {
    this.#origins.set(page, url);
    await page.setViewport({ width, height });
    await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }]);
    await page.goto(`${url}/${query}${view}`);
    await page.waitForSelector('html[data-ready]');
  }

  /** While a server is away the browser itself complains that it cannot be reached; that is what it should do. */
  forgetUnreachable() {
    this.complaints = this.complaints.filter((each) => !/net::ERR_(CONNECTION_REFUSED|INCOMPLETE_CHUNKED_ENCODING|CONNECTION_RESET|EMPTY_RESPONSE)/.test(each));
  }

  async stop() {
    await this.#browser?.close();
  }
}

/** The text of the first element that fits, or nothing. */
export const textOf = (page, selector) => page.$eval(selector, (node) => node.textContent).catch(() => undefined);

/** Waits until an element that fits has a text in which `pattern` is found. */
export async function awaitText(page, selector, pattern, timeout = patience) {
  try {
    await page.waitForFunction((wanted, source, flags) => [...document.querySelectorAll(wanted)]
      .some((node) => new RegExp(source, flags).test(node.textContent)), { timeout, polling: 50 }, selector, pattern.source, pattern.flags);
  } catch (error) {
    const found = await page.$$eval(selector, (nodes) => nodes.map((node) => node.textContent)).catch(() => []);
    throw new Error(`no ${selector} with ${pattern} came; there is ${JSON.stringify(found)}`, { cause: error });
  }
}

/** What axe-core finds, one line each. */
export async function violations(page) {
  if (!await page.evaluate(() => 'axe' in globalThis)) {
    await page.evaluate(axeSource);
  }
  return page.evaluate(async () => (await globalThis.axe.run(document, { resultTypes: ['violations'] })).violations
    .flatMap((rule) => rule.nodes.map((node) => `${rule.id}: ${node.html.slice(0, 160)} (${node.failureSummary})`)));
}

/** Saves a picture in the folder MILLRACE_SCREENSHOTS, if that is set. */
export async function picture(page, name, fullPage = false) {
  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    await page.screenshot({ path: join(pictures, `${name}.png`), fullPage });
  }
}
