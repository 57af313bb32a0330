// Die Gründe, die ein Gateway auf Englisch nennt, auf Deutsch. {} steht für einen Wert; im Deutschen stehen die Werte in
// derselben Reihenfolge, oder mit Nummer ({1}). Was als Wert selbst ein solcher Satz ist, wird auch übersetzt. Der erste
// Satz, der passt, gilt: die genaueren stehen vorn. Fehlertexte von ADS und vom Betriebssystem bleiben, wie sie sind.
export const reasons = [
  // Ohne Dienst: gateway/dispatch/near_miss.cpp, dispatcher.cpp
  ['{}; it is malformed: {}', '{} Sie ist keine gültige UUID: {}.'],
  ['{}; did you mean {}, {}', '{} Ist {} gemeint? ({})'],
  ['{} characters differ', '{} Zeichen sind anders'],
  ['one character is missing', 'ein Zeichen fehlt'],
  ['one character is too many', 'ein Zeichen ist zu viel'],
  ['one character differs', 'ein Zeichen ist anders'],
  ['\'{}\' is no hexadecimal digit', '„{}“ ist keine hexadezimale Ziffer'],
  ['{} characters, a UUID has {}', '{} Zeichen, eine UUID hat {}'],
  ['its dashes are not where a UUID has them', 'ihre Striche stehen an falscher Stelle'],
  ['V.G.SERVICE.UUID is empty; the program must write its service\'s UUID before REQUEST_STATE',
    'V.G.SERVICE.UUID ist leer: Das Programm muss die UUID seines Dienstes vor REQUEST_STATE schreiben.'],
  ['{} {} is served by nobody; its last instance was {}', 'Kein Dienst hat die UUID {1}. Die letzte Instanz war {2}.'],
  ['V.G.SERVICE.UUID {} is served by nobody', 'Kein Dienst hat die UUID {}.'],
  ['uuid {} is served by nobody', 'Kein Dienst hat die UUID {}.'],
  ['{} {}: its instances are draining and take nothing new', 'Die Instanzen von {1} laufen aus und nehmen nichts Neues an.'],
  ['{} {} is served for {}, not for {}', 'Der Dienst {1} ist für {2} da, nicht für {3}.'],
  ['the journal has not confirmed new call numbers yet; the call waits for it',
    'Das Journal hat neue Aufrufnummern noch nicht bestätigt; der Aufruf wartet darauf.'],

  // Wartet, angehalten, verloren
  ['{} is lost with this call, which must not run twice; an operator must answer or retry it',
    '{} ist während dieses Aufrufs ausgefallen, der nicht zweimal laufen darf.'],
  ['{} is deaf with this call, which must not run twice; an operator must answer or retry it',
    '{} nimmt diesen Aufruf nicht an, der nicht zweimal laufen darf.'],
  ['{}, which is gone, may have given this call out; it must not run twice: an operator must answer or retry it',
    '{} ist nicht mehr da und hat diesen Aufruf vielleicht schon vergeben. Er darf nicht zweimal laufen.'],
  ['this gateway, which had left the channel to another one', 'dieses Gateway, das den Kanal einem anderen überlassen hatte,'],
  ['{} is lost; the call goes to another instance', '{} ist ausgefallen; der Aufruf geht an eine andere Instanz.'],
  ['{} does not take what it is given; the call goes to another instance',
    '{} nimmt nichts an; der Aufruf geht an eine andere Instanz.'],
  ['no instance of {} is ready for {}', 'Keine Instanz von {} ist für {} bereit.'],
  ['the only instance is busy', 'Die einzige Instanz ist belegt.'],
  ['all {} instances are busy', 'Alle {} Instanzen sind belegt.'],
  ['{} declines it: {}', '{} lehnt den Aufruf ab: {}'],
  ['given out again by {}', 'Noch einmal vergeben von {}.'],
  ['resumed from the journal', 'Aus dem Journal wieder aufgenommen.'],
  ['no answer within {}; the program waits on', 'Keine Antwort innerhalb von {}; das Programm wartet weiter.'],
  ['its instance is lost, and it must not run twice; the program waits on',
    'Seine Instanz ist ausgefallen, und er darf nicht zweimal laufen; das Programm wartet weiter.'],

  // Antworten, die nicht geschrieben werden können: gateway/response.cpp, open_call_answer.cpp
  ['{}; an operator must answer or retry it', '{} Jemand muss den Aufruf beantworten oder wiederholen.'],
  ['the service\'s answer has state 0, which releases no program', 'Die Antwort des Dienstes hat Zustand 0, der kein Programm weiterlaufen lässt.'],
  ['the service\'s answer is empty, which releases no program that waits for RESPONSE',
    'Die Antwort des Dienstes ist leer; das Programm wartet auf RESPONSE und liefe nicht weiter.'],
  ['the service\'s answer has {} bytes, at most {} fit', 'Die Antwort des Dienstes hat {} Bytes, höchstens {} passen.'],
  ['the service\'s answer has a NUL at byte {}, where a CNC string would end',
    'Die Antwort des Dienstes hat an Byte {} ein NUL, an dem ein Text der CNC endet.'],
  ['the service\'s answer is of a kind that this gateway does not know', 'Die Antwort des Dienstes ist von einer Art, die dieses Gateway nicht kennt.'],
  ['the service\'s answer cannot be written: {}', 'Die Antwort des Dienstes kann nicht geschrieben werden: {}.'],

  // Der Kanal: gateway/channel/
  ['{}: the controller acknowledged {} and does not show it; written {} times',
    '{}: Die Steuerung hat {} bestätigt und zeigt es nicht; {} mal geschrieben.'],
  ['the controller acknowledged {} and does not show it; written {} times',
    'Die Steuerung hat {} bestätigt und zeigt es nicht; {} mal geschrieben.'],
  ['answered; no read has shown yet that the program has gone on', 'Beantwortet; noch ist nicht zu sehen, dass das Programm weiterläuft.'],
  ['RESPONSE_STATE stands beside a request: it may be answered already', 'RESPONSE_STATE steht neben einer Anfrage: Sie ist vielleicht schon beantwortet.'],
  ['connected; what stands in the channel is not known yet', 'Verbunden; was im Kanal steht, ist noch nicht bekannt.'],
  ['the gateway is ending', 'Das Gateway wird beendet.'],
  ['the controller does not let us read the Service Interface of channel {}: {}',
    'Die Steuerung lässt die Service-Schnittstelle von Kanal {} nicht lesen: {}.'],
  ['{} of channel {} cannot be written: {}', '{} von Kanal {} kann nicht geschrieben werden: {}.'],

  // Das Journal
  ['the journal {}; no new call is taken until it can be written', 'Das Journal ({}): Kein neuer Aufruf wird angenommen, bis es geschrieben werden kann.'],

  // Die Maschine und ihre Verbindung: gateway/machines/, gateway/live/machine_link.cpp, cnc/ads/
  ['the configuration has changed', 'Die Konfiguration hat sich geändert.'],
  ['the configuration names its channel no more', 'Die Konfiguration nennt seinen Kanal nicht mehr.'],
  ['this gateway stood still', 'Dieses Gateway stand still.'],
  ['not connected yet', 'Noch nicht verbunden.'],
  ['listening whether another gateway serves this machine', 'Hört, ob ein anderes Gateway diese Maschine bedient.'],
  ['{} serves it already; this gateway stands by', '{} bedient sie schon; dieses Gateway steht bereit.'],
  ['channel {} is served by {} already', 'Kanal {} bedient schon {}.'],
  ['its gateway is gone', 'Ihr Gateway ist nicht mehr da.'],
  ['its channels cannot be counted: {}', 'Ihre Kanäle können nicht gezählt werden: {}.'],
  ['its index groups cannot be found: {}', 'Ihre Indexgruppen können nicht gefunden werden: {}.'],
  ['no channel found: {} is refused: {}. Older controllers have index groups without {}',
    'Kein Kanal gefunden: {} wird abgelehnt: {}. Ältere Steuerungen haben Indexgruppen ohne {}.'],
  ['the controller has no Service Interface: {} is refused: {}. TwinCAT 2 has it from V2.11.2030.01, TwinCAT 3 from V3.1.3057.03',
    'Die Steuerung hat keine Service-Schnittstelle: {} wird abgelehnt: {}. TwinCAT 2 hat sie ab V2.11.2030.01, TwinCAT 3 ab V3.1.3057.03.'],
  ['{}: its name was not resolved in {} ms', '{}: Der Name wurde in {} ms nicht aufgelöst.'],
  ['{}: its name cannot be resolved: {}', '{}: Der Name kann nicht aufgelöst werden: {}.'],
  ['{}: no connection in {} ms: is the host on, is a firewall between?', '{}: keine Verbindung in {} ms. Ist der Rechner an, steht eine Firewall dazwischen?'],
  ['{}: {}: does the ADS router run there, is the TCP port right?', '{}: {}. Läuft dort der ADS-Router, stimmt der TCP-Port?'],
  ['{}: closed while connecting', '{}: beim Verbinden geschlossen.'],
  ['{} breaks the ADS protocol: {}: is this the port of an ADS router?', '{} verletzt das ADS-Protokoll: {}. Ist das der Port eines ADS-Routers?'],
  ['{} has not answered {}: connection given up', '{} hat nicht geantwortet ({}): Verbindung aufgegeben.'],
  ['{} requests in a row of {} ms each', '{} Anfragen nacheinander von je {} ms'],
  ['{} closed the connection ({}): was it restarted, or is there another ADS client on this host? A controller keeps one connection to each address, the newest',
    '{} hat die Verbindung geschlossen ({}). Wurde sie neu gestartet, oder ist auf diesem Rechner ein zweiter ADS-Client? Eine Steuerung behält je Adresse nur die neueste Verbindung.'],
  ['route missing: {} closed the connection before the first answer; it needs a route from NetId {} to {}',
    'Route fehlt: {} hat die Verbindung vor der ersten Antwort geschlossen; sie braucht eine Route von NetId {} nach {}.'],
  ['{} accepted the connection but does not answer: is {} its NetId, and does its route from NetId {} lead to {}?',
    '{} hat die Verbindung angenommen und antwortet nicht. Ist {} ihre NetId, und führt ihre Route von NetId {} nach {}?'],
  ['{} answers, but nothing serves its AMS port {}: does the CNC run?', '{} antwortet, aber nichts bedient ihren AMS-Port {}. Läuft die CNC?'],
  ['{} answers, but does not know NetId {}: is the NetId of the controller right?', '{} antwortet, kennt aber NetId {} nicht. Stimmt die NetId der Steuerung?'],
  ['{} does not tell its state: {}', '{} nennt ihren Zustand nicht: {}.'],

  // Meldungsschlangen: gateway/queues/, gateway/live/symbol_queue.cpp
  ['{} of {} messages that {} has room for are not answered yet by {}, and stay there (drain: WHEN_ANSWERED); {}',
    '{} von {} Meldungen, für die {} Platz hat, sind von {} noch nicht beantwortet und bleiben dort (drain: WHEN_ANSWERED); {}.'],
  ['{} of {} messages that may wait in the journal (backlog) wait for {}, and {} of {} that {} has room for stand there; {}',
    '{} von {} Meldungen, die im Journal warten dürfen (backlog), warten auf {}, und {} von {}, für die {} Platz hat, stehen dort; {}.'],
  ['when it is full, the next SSDQ is a runtime error of its program; see in millrace channels why the call of {} waits',
    'ist sie voll, ist das nächste SSDQ ein Laufzeitfehler ihres Programms; warum der Aufruf von {} wartet, steht in millrace channels'],
  ['{} has LastGet {}, although {} was written there', '{} hat LastGet {}, obwohl {} geschrieben wurde.'],
  ['{} has {} elements, and was read with {}', '{} hat {} Elemente und wurde mit {} gelesen.'],
  ['{} has {} elements; a queue has {} to {}', '{} hat {} Elemente; eine Schlange hat {} bis {}.'],
  ['{} has LastFilled {} and LastGet {}, its elements are 1 to {}: nothing is read and nothing written before a program has initialised it (SSDQInit)',
    '{} hat LastFilled {} und LastGet {}, ihre Elemente sind 1 bis {}: Nichts wird gelesen oder geschrieben, bis ein Programm sie initialisiert hat (SSDQInit).'],
  ['{} has elements of {} bytes; a message has at most {}', '{} hat Elemente von {} Bytes; eine Meldung hat höchstens {}.'],
  ['{} cannot be read: what the controller says of {} is too short', '{} kann nicht gelesen werden: Was die Steuerung von {} sagt, ist zu kurz.'],
  ['{} cannot be read: {} is of a type that is no message (ADS type {}); a queue has texts or numbers',
    '{} kann nicht gelesen werden: {} hat einen Typ, der keine Meldung ist (ADS-Typ {}); eine Schlange hat Texte oder Zahlen.'],
  ['{} cannot be read: the controller says that {} is of {} bytes, a {} has {}',
    '{} kann nicht gelesen werden: Die Steuerung sagt, dass {} {} Bytes hat; ein {} hat {}.'],
  ['{} cannot be read: {} and {} are no whole numbers within {}', '{} kann nicht gelesen werden: {} und {} sind keine ganzen Zahlen in {}.'],
  ['{} cannot be read: {}: {}', '{} kann nicht gelesen werden: {}: {}.'],
  ['{} cannot be read: {}', '{} kann nicht gelesen werden: {}.'],
  ['the answer is too short', 'die Antwort ist zu kurz'],
  ['{} was not found yet', '{} wurde noch nicht gefunden.'],
  ['{} LastGet cannot be written: {}', '{} LastGet kann nicht geschrieben werden: {}.'],
  ['{} LastGet cannot be {}: {}', '{} LastGet kann nicht {} sein: {}.'],
];

const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');
const patterns = reasons.map(([english, german]) => [
  new RegExp(`^${english.split('{}').map(escaped).join('(.+?)')}$`, 's'), german]);

/** Der Satz auf Deutsch; leer, wenn ihn niemand übersetzt hat. */
export function inGerman(english) {
  for (const [pattern, german] of patterns) {
    const found = pattern.exec(english);
    if (found) {
      const values = found.slice(1).map((value) => inGerman(value) || value);
      let next = 0;
      return german.replace(/\{(\d?)\}/g, (_, number) => values[number === '' ? next++ : Number(number)]);
    }
  }
  return '';
}
