// Questions to the server. Whatever goes wrong becomes an Error whose message a person can read, with the HTTP status.
import { words } from './words.js';

/** What the server answered with a status of its own; 0 where there was no answer. */
export class Refusal extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

async function ask(path, options) {
  let response;
  try {
    response = await fetch(path, { credentials: 'same-origin', ...options });
  } catch {
    throw new Refusal(0, words.failure.unreachable);
  }
  const body = await response.json().catch(() => ({}));
  if (!response.ok) {
    throw new Refusal(response.status, body.error ?? `${response.status} ${response.statusText}`);
  }
  return body;
}

/** `parts` are segments of the path below /api, encoded here; `query`, an object or pairs, leaves out what is empty. */
export function get(parts, query = {}) {
  const filled = (Array.isArray(query) ? query : Object.entries(query)).filter(([, value]) => value !== '' && value !== undefined && value !== null);
  const text = new URLSearchParams(filled).toString();
  return ask(`/api/${parts.map(encodeURIComponent).join('/')}${text ? `?${text}` : ''}`);
}

export function post(parts, body, token) {
  return ask(`/api/${parts.map(encodeURIComponent).join('/')}`, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json', ...(token ? { 'X-Millrace-Token': token } : {}) },
    body: JSON.stringify(body),
  });
}
