-- description: A rate for a sentence: three digits ('83.1 Hz', '1230 Hz').
CREATE OR REPLACE MACRO derive.rate_text(hz) AS
CASE WHEN hz >= 999.5 THEN printf('%.0f Hz', hz) ELSE printf('%.3g Hz', hz) END
