import sys
from collections import Counter

import jaus.capture

names = Counter()
for record in jaus.capture.read(sys.argv[1]):
    names[record.message.name if record.message else record.error] += 1
for name, count in names.most_common(3):
    print(f"{count:6} {name}")
