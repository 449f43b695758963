// A tone for each new fault. Browsers play nothing before a person has touched the page once.

export class Sound {
  constructor() {
    this.button = document.getElementById("sound");
    this.isOn = false;
    this.button.onclick = () => this.turn(!this.isOn);
  }

  turn(on) {
    this.isOn = on;
    this.button.setAttribute("aria-pressed", on);
    this.button.textContent = on ? "Sound on" : "Sound off";
    if (on) { this.context ??= new AudioContext(); this.context.resume(); this.tone(660, 0.08); }
  }

  fault() { if (this.isOn) { this.tone(880, 0.18); setTimeout(() => this.tone(660, 0.25), 220); } }

  tone(hertz, seconds) {
    const source = this.context.createOscillator(), volume = this.context.createGain(), now = this.context.currentTime;
    source.frequency.value = hertz;
    volume.gain.setValueAtTime(0.2, now); volume.gain.exponentialRampToValueAtTime(0.001, now + seconds);
    source.connect(volume).connect(this.context.destination);
    source.start(now); source.stop(now + seconds);
  }
}
