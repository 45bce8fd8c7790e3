import "./style.css";
import { applyTheme, Explorer } from "./page/explorer.ts";
import { SERVICE } from "./page/loader.ts";

applyTheme(matchMedia("(prefers-color-scheme: light)").matches);
new Explorer(SERVICE);
