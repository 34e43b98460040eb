-- description: A duration for a sentence: three digits, with the unit that fits ('83.1 ms').
-- param: duration_ns BIGINT  The duration, in ns
CREATE OR REPLACE MACRO main.duration_text(duration_ns) AS
CASE
    WHEN abs(duration_ns) >= 999_500_000_000 THEN printf('%.0f s', duration_ns / 1e9)
    WHEN abs(duration_ns) >= 999_500_000 THEN printf('%.3g s', duration_ns / 1e9)
    WHEN abs(duration_ns) >= 999_500 THEN printf('%.3g ms', duration_ns / 1e6)
    WHEN abs(duration_ns) >= 1_000 THEN printf('%.3g µs', duration_ns / 1e3)
    ELSE printf('%d ns', duration_ns)
END
