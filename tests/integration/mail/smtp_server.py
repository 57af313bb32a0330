#!/usr/bin/python3
"""A mail server for tests (aiosmtpd): keeps what it accepts as files and refuses on demand.

    smtp_server.py FOLDER [--port N] [--cert FILE --key FILE [--implicit] [--user NAME --password WORD]]

Prints "ready: PORT". Accepted mails are FOLDER/1.mail, 2.mail ...: the envelope in the lines "from" and "to",
an empty line, the message. FOLDER/answer, read whenever a mail arrives, contains what happens instead:

    rcpt 550 5.1.1 unknown    this reply to each recipient
    stall eva@example.com     no reply for this recipient
    data 451 4.7.1 later      this reply to the end of the message
    hold                      keeps the mail and sends nothing more
    drop                      keeps the mail and closes the connection
    no goodbye                takes the mail and does not answer QUIT
"""
import argparse
import asyncio
import os
import pathlib
import ssl

from aiosmtpd.smtp import AuthResult, SMTP


class Handler:
    def __init__(self, folder):
        self.folder = folder
        self.count = 0

    def answer(self):
        try:
            return (self.folder / "answer").read_text().strip()
        except FileNotFoundError:
            return ""

    async def handle_RCPT(self, server, session, envelope, address, options):
        answer = self.answer()
        if answer.startswith("rcpt "):
            return answer[5:]
        if answer == f"stall {address}":
            await asyncio.Event().wait()
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, server, session, envelope):
        answer = self.answer()
        if answer.startswith("data "):
            return answer[5:]
        self.count += 1
        lines = [f"from {envelope.mail_from}", *(f"to {to}" for to in envelope.rcpt_tos), "", ""]
        part = self.folder / "part"
        part.write_bytes("\n".join(lines).encode() + envelope.content)
        os.rename(part, self.folder / f"{self.count}.mail")
        if answer == "hold":
            await asyncio.Event().wait()
        if answer == "drop":
            server.transport.abort()
        return "250 2.0.0 OK"

    async def handle_QUIT(self, server, session, envelope):
        if self.answer() == "no goodbye":
            await asyncio.Event().wait()
        return "221 2.0.0 Bye"


def authenticator(user, password):
    def check(server, session, envelope, mechanism, data):
        good = data.login == user.encode() and data.password == password.encode()
        return AuthResult(success=good, handled=good)

    return check


async def serve(arguments):
    options = {"hostname": "localhost"}
    context = None
    if arguments.cert:
        context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
        context.load_cert_chain(arguments.cert, arguments.key)
        if not arguments.implicit:
            options |= {"tls_context": context, "require_starttls": True}
    if arguments.user:
        options |= {"auth_required": True, "auth_require_tls": not arguments.implicit, "authenticator": authenticator(arguments.user, arguments.password)}
    handler = Handler(arguments.folder)
    loop = asyncio.get_running_loop()
    from_the_start = context if arguments.implicit else None
    server = await loop.create_server(
        lambda: SMTP(handler, loop=loop, **options), "127.0.0.1", arguments.port, ssl=from_the_start)
    print(f"ready: {server.sockets[0].getsockname()[1]}", flush=True)
    await server.serve_forever()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--cert")
    parser.add_argument("--key")
    parser.add_argument("--implicit", action="store_true", help="TLS from the first byte")
    parser.add_argument("--user")
    parser.add_argument("--password")
    asyncio.run(serve(parser.parse_args()))


if __name__ == "__main__":
    main()
