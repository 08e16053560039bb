"""What a browser is asked about the page that it shows: whether everything in it can be read."""

# WCAG 2.1, success criterion 1.4.3: text, drawings' text included, whose contrast is below 4.5
FAINT = """(() => {
            const rgb = c => c.match(/[\\d.]+/g).map(Number);
            const light = c => rgb(c).slice(0, 3).map(v => v / 255).map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
                .reduce((s, v, i) => s + v * [0.2126, 0.7152, 0.0722][i], 0);
            const behind = e => { for (; e; e = e.parentElement) { const c = getComputedStyle(e).backgroundColor;
                if (rgb(c).length < 4 || rgb(c)[3] > 0) return c } return 'rgb(255,255,255)' };
            const found = [];
            for (const e of document.querySelectorAll('main p, main td, main th, main li, figcaption, h1, h2, .kicker, dt, dd, svg text,'
                + '.legend button, .tools button, .hint, .hint button, .y-label, .tip')) {
                if (!e.checkVisibility() || e.classList.contains('flag-text')) continue;
                const svg = e instanceof SVGElement;
                const [a, b] = [light(svg ? getComputedStyle(e).fill : getComputedStyle(e).color), light(behind(e))].sort((x, y) => y - x);
                if ((a + 0.05) / (b + 0.05) < 4.5) found.push([(a + 0.05) / (b + 0.05), e.textContent.slice(0, 40)]);
            }
            // 1.4.11: curves stand out from their ground by a contrast of 3
            const style = name => { const p = document.createElement('p'); p.style.color = `var(--${name})`; document.body.append(p);
                const c = getComputedStyle(p).color; p.remove(); return light(c) };
            for (const name of ['measured', 'before', 'after', 'third']) {
                const [a, b] = [style(name), style('paper')].sort((x, y) => y - x);
                if ((a + 0.05) / (b + 0.05) < 3) found.push([(a + 0.05) / (b + 0.05), name]);
            }
            return found })()"""

# what is wider than the screen
OVER_THE_EDGE = """[...document.querySelectorAll('main *:not(svg *)')].filter(e => e.getBoundingClientRect().right > innerWidth + 1 && getComputedStyle(e).position !== 'absolute' && !e.closest('thead')).map(e => e.outerHTML.slice(0, 80))"""

# of every drawing: its size, texts that are cut off, names that overlap, and the smallest text
DRAWINGS = """[...document.querySelectorAll('figure svg[role=img]')].filter(s => s.checkVisibility()).map(s => {
            const frame = s.getBoundingClientRect();
            const texts = [...s.querySelectorAll('text')].map(t => t.getBoundingClientRect());
            return {
                label: s.getAttribute('aria-label'), width: frame.width, height: frame.height,
                outside: texts.filter(t => t.left < frame.left - 1 || t.right > frame.right + 1 || t.top < frame.top - 1
                                           || t.bottom > frame.bottom + 1).length,
                touching: (() => {
                    const names = [...s.querySelectorAll('text.label')].map(t => [t.textContent, t.getBoundingClientRect()]);
                    return names.flatMap(([one, a], i) => names.slice(i + 1).filter(([, b]) => a.left < b.right && b.left < a.right
                        && a.top < b.bottom - 2 && b.top < a.bottom - 2).map(([other]) => one + ' / ' + other));
                })(),
                size: Math.min(...texts.map(t => t.height)),
            }})"""
