// The same manager for Node.
const lines = require("readline").createInterface({ input: process.stdin });
let needed = new Set();
let failed = false;

function answer(message) {
  switch (message.type) {
    case "mission_started":
      needed = new Set();
      failed = false;
      return {
        protocol: 1,
        period_s: 2.0,
        subscribes_to: ["component_status"],
        depends_on: { water_visibility: [2.25, 3.25] },
      };
    case "task_requested":
      message.functions.forEach((name) => needed.add(name));
      return {};
    case "task_cancelled":
      message.functions.forEach((name) => needed.delete(name));
      return {};
    case "diagnostic":
      failed = message.value === "FALSE";
      return {};
    case "adapt": {
      const visibility = message.measured.water_visibility ?? 0;
      const height = visibility >= 3.25 ? "high" : visibility >= 2.25 ? "medium" : "low";
      const modes = { f_maintain_motion: failed ? "fd_recover_thrusters" : "fd_all_thrusters" };
      if (needed.has("f_generate_search_path")) modes.f_generate_search_path = `fd_spiral_${height}`;
      if (needed.has("f_follow_pipeline")) modes.f_follow_pipeline = "fd_follow_pipeline";
      return { modes };
    }
    default:
      return {};
  }
}

lines.on("line", (line) => process.stdout.write(JSON.stringify(answer(JSON.parse(line))) + "\n"));
