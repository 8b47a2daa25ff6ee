// Gives each contact that begins its end, also where messages were lost, or traction-touch was killed.

const silence_ms = 1000;  // without a message of traction-touch its contacts end

/** A contact's end, without what holds only while it is seen. */
function endOf(contact, end_cause) {
  const none = () => ({noise: new Float64Array(9), systematic: new Float64Array(9)});
  return {...contact, phase: "end", end_cause, force_N: [0, 0, 0], force_deviation_N: [0, 0, 0], velocity_m_s: [0, 0],
    velocity_deviation_m_s: [0, 0], slip: null, moment_Nm: [0, 0, 0], force_covariance_N2: none(),
    moment_covariance_N2m2: none(), force_moment_covariance_N2m: none(), angular_velocity_rad_s: 0,
    angular_velocity_deviation_rad_s: 0};
}

/** The contacts of one topic, as the messages that a subscriber has received leave them. */
export class PairedContacts {
  #last = null;
  #open = new Map();  // id -> contact that has begun and not ended
  #heard_ms = 0;
  #isSuspected = false;  // by the turn before

  get areOpen() {
    return this.#open.size > 0;
  }

  /** Takes the next message, and changes it so that begins and ends pair: adds, first, the ends of those that have begun
      and are of another run or missing in it; lets one that has not begun begin where it is seen; leaves out others. */
  complete(message, now_ms) {
    const isSameRun = this.#last?.run === message.run;
    const listed = new Set(isSameRun ? message.contacts.map(({id}) => id) : []);
    const all = [];
    for (const [id, contact] of this.#open) {
      if (listed.has(id)) continue;
      all.push(endOf(contact, isSameRun ? "not_seen" : "stopped"));
      this.#open.delete(id);
    }
    for (const contact of message.contacts) {
      const {id} = contact, isOpen = this.#open.has(id), isSeen = ["begin", "move"].includes(contact.phase);
      if (!isOpen && !isSeen) continue;
      if (isSeen) contact.phase = isOpen ? "move" : "begin";
      all.push(contact);
      if (contact.phase === "end") this.#open.delete(id);
      else this.#open.set(id, contact);
    }
    message.contacts = all;
    this.#last = message;
    this.#heard_ms = now_ms;
    this.#isSuspected = false;
  }

  /** To be called in turns. Returns a message with the ends of all, if none has come for a second, or null. The second
      of two turns says so: what waited for a reader that was busy comes between them. */
  endIfSilent(now_ms) {
    const isSilent = this.areOpen && now_ms - this.#heard_ms >= silence_ms;
    const isSure = isSilent && this.#isSuspected;
    this.#isSuspected = isSilent && !isSure;
    if (!isSure) return null;
    const contacts = [...this.#open.values()].map((contact) => endOf(contact, "not_seen"));
    this.#open.clear();
    return {...this.#last, header: {...this.#last.header}, valid: false, contacts, critical_points: []};
  }
}
