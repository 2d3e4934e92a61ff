// Flow control between page and station, so that nothing queues on the way: as many setpoints are under
// way as an idle link's round trip explains, and the newest replaces what waits. Every setpoint says
// which state the operator has seen last and for how long, so that the station knows how old it is.
//
// Frames to the station: [seq, held] confirms that the state `seq` is shown, `held` milliseconds after it
// arrived, [seq] that it has arrived but is not shown, [seq, held, forward, turn] drives, and [] ends that.
// [seq, held, forward, turn, hand] drives by a hand that counts for `hand` milliseconds without another sign.

/** A setpoint that has waited this long is not sent any more, in milliseconds. */
const LONGEST_WAIT = 200;
/** By a state that arrived so long ago the station lets nobody drive: it allows 0.3 s beyond the round trip, by a
 * clock that may be 17 % slower. */
const LONGEST_HELD = 360;
/** Without a confirmation for this long, the station does not receive setpoints. */
const STUCK = 1_000;
/** Setpoints follow each other by so much: a round trip of it needs no second one under way. */
const PERIOD = 100;
/** Most setpoints under way: the station refuses links that would need more. */
const MOST = 8;
/** The idle link's round trip grows by this part of the time at most: a link that is never idle looks like a long one. */
const FOLLOWS = 0.01;
/** A confirmation that is later than an idle link's by this has met a queue or a loss. */
const DELAYED = 100;
/** So many late confirmations in a row are no single loss, nor a page that stood still for a moment. */
const QUEUED = 2;
/** A link that queues rests for so many times the delay after each setpoint: a stop must not wait behind them. */
const PAUSE = 2;
const LONGEST_PAUSE = 2_000;

export class Flow {
  #transmit;
  #now;
  /** When the drives and releases that the station has not confirmed were sent, oldest first. */
  #underWay = [];
  /** The round trip of the idle link, and when it was measured; null before the first confirmation. */
  #idle = null;
  /** What the station knows of it, for the first setpoints. */
  #estimate = 0;
  /** How many confirmations in a row were late. */
  #late = 0;
  /** Most setpoints under way as long as a queue is feared. */
  #most = MOST;
  /** Until then the link rests. */
  #restsUntil = 0;
  /** The setpoint that is sent next. */
  #waiting = null;
  /** Whether a setpoint was sent since the last release. */
  #driving = false;
  /** The last state shown, and when it arrived: drawing it takes time, which is no delay of the link. */
  #seen = null;
  #arrivedAt = 0;
  /** Whether the station does not know yet that it was shown. */
  #unconfirmed = false;

  /** Sends frames with `transmit`, which returns false if there is no connection. */
  constructor(transmit, now = () => performance.now()) {
    this.#transmit = transmit;
    this.#now = now;
  }

  /** Forgets everything: the connection is new. */
  reset() {
    [this.#underWay, this.#idle] = [[], null];
    [this.#estimate, this.#late, this.#most, this.#restsUntil] = [0, 0, MOST, 0];
    this.#waiting = this.#seen = null;
    this.#driving = this.#unconfirmed = false;
  }

  /** The station has measured this round trip, in milliseconds or null. */
  estimate(roundTrip) {
    this.#estimate = roundTrip ?? 0;
  }

  /** Drives by a hand that counts until `expiry` without another sign; false if the setpoint cannot reach the
   * station now. */
  setpoint({ forward, turn, expiry = Infinity }) {
    const now = this.#now();
    if (this.#seen === null || now - (this.#underWay[0] ?? now) > STUCK) return false;
    this.#waiting = { forward: thousandths(forward), turn: thousandths(turn), expiry, at: now };
    return !this.#mayDrive() || this.#next();
  }

  /** Ends driving. The release is sent at once, in place of a setpoint that waits. */
  release() {
    this.#waiting = null;
    if (!this.#driving) return;
    this.#driving = false;
    this.#send([]);
  }

  /** The station has received a setpoint or a release. */
  confirmed() {
    const sentAt = this.#underWay.shift();
    if (sentAt === undefined) return;
    this.#measure(this.#now() - sentAt);
    if (this.#mayDrive() && this.#next()) return;
    if (this.#underWay.length === 0 && this.#unconfirmed) this.#confirm();
  }

  /** The state `seq` is on the screen, and arrived at `arrivedAt`. */
  shown(seq, arrivedAt = this.#now()) {
    this.#seen = seq;
    this.#arrivedAt = arrivedAt;
    this.#unconfirmed = true;
    // During a drive the next setpoint confirms the state as well. After it, a long link would wait a
    // round trip for that; one that queues does wait.
    if (this.#underWay.length === 0 || !(this.#driving || this.#isOverdue)) this.#confirm();
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
    const [setpoint, now] = [this.#waiting, this.#now()];
    this.#waiting = null;
    if (setpoint === null || now - setpoint.at > LONGEST_WAIT || now >= setpoint.expiry) return false;
    const hand = setpoint.expiry === Infinity ? [] : [Math.ceil(setpoint.expiry - now)];
    if (!this.#send([this.#seen, this.#held(), setpoint.forward, setpoint.turn, ...hand])) return false;
    this.#driving = true;
    this.#unconfirmed = false;
    return true;
  }

  #send(frame) {
    if (!this.#transmit(frame)) return false;
    this.#underWay.push(this.#now());
    return true;
  }

  /** Whether one more setpoint under way would neither have to wait, nor be refused. */
  #mayDrive() {
    if (this.#held() > LONGEST_HELD) return false;
    const useful = 1 + Math.floor(this.#idleRoundTrip / PERIOD);
    return this.#underWay.length < Math.min(useful, this.#most) && this.#now() >= this.#restsUntil;
  }

  /** One at a time and with pauses when the link queues, and then more again while confirmations are prompt. */
  #measure(roundTrip) {
    const now = this.#now();
    const grown = this.#idle ? this.#idle.roundTrip + FOLLOWS * Math.min(1_000, now - this.#idle.at) : Infinity;
    this.#idle = { at: now, roundTrip: Math.min(roundTrip, grown) };
    const delay = roundTrip - this.#idle.roundTrip;
    this.#late = delay > DELAYED ? this.#late + 1 : 0;
    if (this.#late >= QUEUED) [this.#most, this.#restsUntil] = [1, now + Math.min(PAUSE * delay, LONGEST_PAUSE)];
    else if (this.#late === 0) this.#most = Math.min(this.#most + 1, MOST);
  }

  /** Whether the oldest frame under way should have been confirmed by now. */
  get #isOverdue() {
    return this.#now() - (this.#underWay[0] ?? this.#now()) > this.#idleRoundTrip + DELAYED;
  }

  /** The round trip of the idle link, as far as it is known. */
  get #idleRoundTrip() {
    return this.#idle?.roundTrip ?? this.#estimate;
  }

  #held() {
    return Math.round(this.#now() - this.#arrivedAt);
  }
}

const thousandths = (value) => Math.round(value * 1_000) / 1_000;
