// A service over HTTP with Node alone: answers a number with its square root.
//
//   node service.mjs [PORT]
import { createServer } from "node:http";

createServer(async (request, response) => {
  let body = "";
  for await (const part of request) body += part;
  if (request.method !== "POST") return response.writeHead(405).end();
  const { text } = JSON.parse(body);
  const root = Math.sqrt(Number(text));
  const answer = Number.isNaN(root) ? { text: `ERROR: no root of '${text}'`, state: 99 } : { text: root.toFixed(6), state: 1 };
  response.writeHead(200, { "Content-Type": "application/json" }).end(JSON.stringify(answer));
}).listen(Number(process.argv[2] ?? 8000), "127.0.0.1");
