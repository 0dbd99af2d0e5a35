// The WebSocket: questions out, answers in; after a break it connects again and asks anew.
import { t } from "./texts.js";

const KINDS = { 1: "piece", 2: "section-points", 3: "diagram-points", 4: "exponents", 5: "frame" };
const REFUSED = 1013; // too many pages: the server has said so
export const token = new URLSearchParams(location.search).get("token") ?? "";

/** An address of this server, with the token. */
export function address(path, values = {}) {
  const query = new URLSearchParams({ ...values, token });
  return `${path}?${query}`;
}

/** A request that says why where it fails. */
export async function request(path, values = {}, options = {}) {
  const answer = await fetch(address(path, values), options);
  if (!answer.ok) throw new Error(await answer.text());
  return answer;
}

export class Link {
  constructor(notice) {
    this.handlers = {};
    this.notice = notice;
    this.tries = 0;
    this.connect();
  }

  on(kind, handler) {
    (this.handlers[kind] ??= []).push(handler);
  }

  emit(kind, ...values) {
    for (const handler of this.handlers[kind] ?? []) handler(...values);
  }

  connect() {
    this.socket = new WebSocket(`ws://${location.host}${address("/api/socket")}`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      if (this.tries) this.notice(t("back"));
      this.tries = 0;
      this.emit("open");
    };
    this.socket.onmessage = ({ data }) => this.take(data);
    this.socket.onclose = ({ code }) => {
      if (code === REFUSED) return;
      this.tries += 1;
      if (this.tries > 1) this.notice(t(this.tries > 6 ? "gone" : "lost"), true);
      setTimeout(() => this.connect(), Math.min(200 * 2 ** this.tries, 4000));
    };
  }

  say(message) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  take(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      this.emit(message.type, message);
      return;
    }
    const [kind, generation, ...numbers] = new Uint32Array(data, 0, 8);
    const body = kind === 5 ? new Uint8Array(data, 32) : new Float64Array(data, 32);
    this.emit(KINDS[kind], { generation, numbers, body });
  }
}
