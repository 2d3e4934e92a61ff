// Flow control between page and station, so that nothing queues on the way: at most one setpoint is
// under way, and the newest replaces what waits. Every setpoint says which state the operator has
// seen last and for how long, so that the station knows how old it is.
//
// Frames to the station: [seq, held] confirms that the state `seq` has been shown for `held`
// milliseconds, [seq] that it has arrived but is not shown, and [seq, held, forward, turn] drives.

/** A setpoint that has waited this long is not sent any more, in milliseconds. */
const LONGEST_WAIT = 200;
/** Without a confirmation for this long, the station does not receive setpoints. */
const STUCK = 1_000;

export class Flow {
  #transmit;
  #now;
  /** Drives and releases that the station has not confirmed. */
  #underWay = 0;
  /** When the oldest of them was sent. */
  #sentAt = 0;
  /** The setpoint that is sent next. */
  #waiting = null;
  /** Whether a setpoint was sent since the last release. */
  #driving = false;
  /** The last state shown, and when. */
  #seen = null;
  #seenAt = 0;
  /** Whether the station does not know yet that it was shown. */
  #unconfirmed = false;

  /** Sends frames with `transmit`, which returns false if there is no connection. */
  constructor(transmit, now = () => performance.now()) {
    this.#transmit = transmit;
    this.#now = now;
  }

  /** Forgets everything: the connection is new. */
  reset() {
    this.#underWay = 0;
    this.#waiting = this.#seen = null;
    this.#driving = this.#unconfirmed = false;
  }

  /** Drives; false if the setpoint cannot reach the station now. */
  setpoint({ forward, turn }) {
    const now = this.#now();
    if (this.#seen === null || (this.#underWay && now - this.#sentAt > STUCK)) return false;
    this.#waiting = { forward: thousandths(forward), turn: thousandths(turn), at: now };
    return this.#underWay > 0 || this.#next();
  }

  /** Ends driving. The release is sent at once, in place of a setpoint that waits. */
  release() {
    this.#waiting = null;
    if (!this.#driving) return;
    this.#driving = false;
    this.#send({ type: "drive_end" });
  }

  /** The station has received a setpoint or a release. */
  confirmed() {
    if (this.#underWay === 0) return;
    this.#underWay -= 1;
    this.#sentAt = this.#now();
    if (this.#underWay === 0 && !this.#next() && this.#unconfirmed) this.#confirm();
  }

  /** The state `seq` is on the screen. */
  shown(seq) {
    this.#seen = seq;
    this.#seenAt = this.#now();
    this.#unconfirmed = true;
    // While a setpoint is under way the link is busy: the next one confirms the state as well.
    if (this.#underWay === 0) this.#confirm();
  }

  /** The state `seq` has arrived, but the browser shows nothing now. */
  received(seq) {
    this.#transmit([seq]);
  }

  #confirm() {
    if (this.#transmit([this.#seen, this.#held()])) this.#unconfirmed = false;
  }

  /** Sends the setpoint that waits; false if there is none, or no connection. */
  #next() {
    const setpoint = this.#waiting;
    this.#waiting = null;
    if (setpoint === null || this.#now() - setpoint.at > LONGEST_WAIT) return false;
    if (!this.#send([this.#seen, this.#held(), setpoint.forward, setpoint.turn])) return false;
    this.#driving = true;
    this.#unconfirmed = false;
    return true;
  }

  #send(frame) {
    if (!this.#transmit(frame)) return false;
    if (this.#underWay++ === 0) this.#sentAt = this.#now();
    return true;
  }

  #held() {
    return Math.round(this.#now() - this.#seenAt);
  }
}

const thousandths = (value) => Math.round(value * 1_000) / 1_000;
