from pathlib import Path

from jaus import messages

lamps = messages.load(Path(__file__).with_name("lamps.xml"))

message = lamps.SetLamps(
    lamp_list=[
        lamps.SetLamps.Lamp(place=lamps.SetLamps.Place.FRONT_LEFT, brightness_percent=40),
        {"place": 2},
    ]
)
print(message.encode().hex())
print(messages.decode(message.encode()) == message)
print(message.to_json())
