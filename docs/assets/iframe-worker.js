// Browsers refuse workers in pages that were opened as files. The search then runs in a hidden frame.
if (location.protocol === "file:") {
  window.IFrameWorker = window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.onmessage = this.onerror = null;
      const waiting = [];
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.appendChild(frame);
      const inside = frame.contentWindow;
      const script = inside.document.createElement("script");
      this.postMessage = (data) => waiting.push(data);
      inside.postMessage = (data) => {
        const event = new MessageEvent("message", { data });
        this.dispatchEvent(event);
        if (this.onmessage) this.onmessage(event);
      };
      script.onload = () => {
        this.postMessage = (data) => setTimeout(() => inside.dispatchEvent(new inside.MessageEvent("message", { data })));
        waiting.forEach(this.postMessage);
      };
      script.src = new URL(url, location.href).href;
      inside.document.body.appendChild(script);
      this.terminate = () => frame.remove();
    }
  };
}
