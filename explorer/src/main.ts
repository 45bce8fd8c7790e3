import "./style.css";
import { applyTheme, Explorer } from "./page/explorer.ts";

applyTheme(matchMedia("(prefers-color-scheme: light)").matches);
new Explorer();
