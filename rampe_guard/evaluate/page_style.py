"""How the page of an evaluation looks: on paper, on a screen by day and by night, on a phone."""

from __future__ import annotations

from typing import Final

STYLE: Final = """
:root{--ink:#1d2126;--soft:#5b646e;--line:#dfe3e8;--paper:#fff;--pane:#f6f7f9;--ours:#c1440e;
--velocity:#1f6fb2;--proximity:#6b7a2b;--primitive:#8e4fa8;--usual:#00838a;--stopping:#6d6d6d;
--contact:#1d2126;--true:#2a8f5b;--false:#c9a000;color-scheme:light dark}
@media(prefers-color-scheme:dark){:root{--ink:#e8eaed;--soft:#a4adb7;--line:#343a42;
--paper:#15181c;--pane:#1d2126;--ours:#ff7a45;--velocity:#6cb2ef;--proximity:#b5c76a;
--primitive:#cf9be6;--usual:#4fc7cd;--stopping:#a8a8a8;--contact:#fff;--true:#58c68c;
--false:#e6c545}}
*{box-sizing:border-box}
body{margin:0 auto;max-width:1240px;padding:20px 24px 60px;background:var(--paper);
color:var(--ink);font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
h1{font-size:1.5rem;margin:.3em 0}h2{font-size:1.25rem;margin:2.2em 0 .3em}
h3{font-size:1rem;margin:1.4em 0 .3em}
.lead{font-size:1.15rem;max-width:62em}.small,small{color:var(--soft);font-size:.8rem}
section>p{max-width:62em;color:var(--soft);margin-top:0}
.cards{list-style:none;margin:1em 0 .5em;padding:0;display:grid;gap:10px;
grid-template-columns:repeat(auto-fit,minmax(150px,1fr))}
.cards li{background:var(--pane);border:1px solid var(--line);border-radius:8px;padding:10px 14px}
.cards b{display:block;font-size:1.45rem;line-height:1.2}
.cards span{color:var(--soft);font-size:.85rem}
.grid{display:grid;gap:18px;grid-template-columns:repeat(auto-fit,minmax(min(100%,440px),1fr))}
.grid>figure:only-child{max-width:611px}
figure{margin:0;padding:12px 12px 6px;border:1px solid var(--line);border-radius:8px}
figcaption{font-weight:600;margin-bottom:4px}
svg{display:block;width:100%;height:auto}
svg text{fill:var(--ink);font-size:14px}svg .tick,svg .name{fill:var(--soft)}
svg .row{font-size:14px}svg .strong{font-weight:600}
svg .on-bar{fill:var(--paper);font-weight:600}
.grid line,line.grid{stroke:var(--line);stroke-width:1}
.line{fill:none;stroke-width:2;stroke-linejoin:round}.thin{stroke-width:1.3}
.line.ink{stroke:var(--ink)}
.line.guard{stroke:var(--ours);stroke-width:3.2}.line.guard.thin{stroke-width:1.5}
.line.velocity{stroke:var(--velocity)}
.line.proximity{stroke:var(--proximity);stroke-dasharray:8 3}
.line.primitive{stroke:var(--primitive);stroke-dasharray:3 3}
.line.usual{stroke:var(--usual)}.line.stopping{stroke:var(--stopping)}
.line.ideal{stroke:var(--soft);stroke-dasharray:5 5;stroke-width:1.3}
.line.rail{stroke:var(--line);stroke-width:1}
.line.caution{stroke:var(--usual);stroke-dasharray:3 3}.line.warning{stroke:var(--ours)}
.line.imminent{stroke:var(--primitive);stroke-dasharray:9 3}
text.caution{fill:var(--usual)}text.warning{fill:var(--ours)}text.imminent{fill:var(--primitive)}
.mark{stroke:var(--paper);stroke-width:.25}
.mark.guard{fill:var(--ours)}.mark.velocity{fill:var(--velocity)}
.mark.proximity{fill:var(--proximity)}.mark.primitive{fill:var(--primitive)}
.mark.usual{fill:var(--usual)}
.mark.stopping{fill:none;stroke:var(--stopping);stroke-width:.5}
.bar{fill:var(--soft)}.bar.ours{fill:var(--ours)}
.contact{fill:var(--contact);background:var(--contact)}
.blind{fill:#8b008b;background:#8b008b;opacity:.3}
.true-alarm{fill:var(--true);background:var(--true)}
.false-alarm{fill:var(--false);background:var(--false)}
.undecided-alarm{fill:none;stroke:var(--soft);stroke-dasharray:3 2;border:1px dashed var(--soft)}
.false-mark{fill:none;stroke:var(--ink);stroke-width:.5}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;margin:.4em 0 .8em;color:var(--ink)}
.legend span{display:inline-flex;align-items:center;gap:7px;font-size:.9rem}
.legend svg{width:34px;flex:none}
.key{width:22px;height:12px;border-radius:2px;display:inline-block}
.key.contact{height:16px;width:8px}.key.false-alarm{height:7px}
.wide{overflow-x:auto}.wide svg{min-width:860px}
table{border-collapse:collapse;font-size:.9rem;min-width:100%}
th,td{padding:5px 10px;text-align:right;border-bottom:1px solid var(--line);white-space:nowrap;
vertical-align:top}
thead th{color:var(--soft);font-weight:500;white-space:normal;vertical-align:bottom}
th:first-child{text-align:left;position:sticky;left:0;background:var(--paper)}
tbody th{font-weight:400}.strong td,.strong th{font-weight:700}
td small{display:block;font-weight:400}
dl{display:grid;grid-template-columns:minmax(9em,auto) 1fr;gap:4px 18px;font-size:.9rem}
dt{font-weight:600;overflow-wrap:anywhere}dd{margin:0;color:var(--soft)}
@media(max-width:600px){body{padding:12px 12px 40px}.lead{font-size:1.05rem}
svg text{font-size:19px}.wide svg text{font-size:14px}figure{padding:8px 4px 4px}
.cards{grid-template-columns:1fr 1fr}dl{grid-template-columns:1fr}dt{margin-top:8px}}
"""
