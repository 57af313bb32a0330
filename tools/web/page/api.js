// Requests to the server. Every failure becomes an Error with a message for people and the HTTP status.
import { words } from './words.js';

/** A response with an error status; status 0 if there was no response. */
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

/** `parts` are segments of the path below /api, encoded here; empty values of `query`, an object or pairs, are left out. */
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
