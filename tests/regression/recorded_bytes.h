#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; owners and all that is made with them, at the commit where Muon began to train the extractor's
// matrices; baked fields and what is read from them, at the commit that bakes with emphasis and with
// small steps on fine levels, but "fast logits" on AVX2 at the commit that makes the last small motion of an
// alignment. AVX-512 is not recorded.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "e525075ff3ec5fdeb2e72c07a0fb3b87cb4b039d71a35058f465bc9039673d06"},
    {"code logits", "9613e54e8692e34788c1420773b95ac1f73cad031192077e2866490bda867c3e"},
    {"code owner", "7d93be5dbf71220a5dd26118b7514153c369100f804bd41a38433ed5da88c08b"},
    {"code renders", "d0bca072caacf18a15df2011528728fca35746a11ee89388767de5176b1fdce3"},
    {"fast baked field", "15c7025b7fb69f3db9148715acaf30a437513e0260e28d2ddecb10697c89fcfc"},
    {"fast logits", "f8d162a0fcbdf82389111123b056025e563404d61a1a9d35711d5c5fa7f68979"},
    {"fast owner", "0e2b276bee54492a21f524a218b5386f2feb071f451b22bb4e409198ab7c548c"},
    {"fast renders", "ce84596ccd3d348d119c53c57cbe7c064b4ce9d738dd09d55d5efa7d5dd3b8b8"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "efef6cac3598d64e060bbe324ff30e8bbf4848edcf2476454dd31584f9c2cb44"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "8832ad2aaf0cf5a67b3e5cf139d284ff1bb027be25712b55daa76aac88f65a8f"},
    {"paper renders", "55266355752c4130cddab01038d2832c572a2b8fbf917944c6595f1ec4451938"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "4e1454e710617ea1697d927c047da540b1ea47ff40d4ee4d55a24bc4705597b4"},
    {"code logits", "ffcee264fa4775230837e60e2f1f6924d57de0dc5095160442c3c5c097127659"},
    {"code owner", "984dc2b560f17c500cf72d6efcfcb3fed3f35fc6e1e909ce7b43f8a93e039e02"},
    {"code renders", "a5f6f7610d3dde3d4744590c2ef9f553cc8866fdfa796d814676b5d6f7948a43"},
    {"fast baked field", "17af66e1d94b2ccfda000cc01e7e5494f8f021d7bc49bf7e8cbbedc7d659aaac"},
    {"fast logits", "f6aba7ec931e26b80aca73945a129333d2587d2a08174004bc9992a33d94c385"},
    {"fast owner", "1cb3eb634830b3ffab0d7aab39e5b7bae380052cf3489c93a842a670f5b8cdcb"},
    {"fast renders", "98e6bbc8b57e790ffb2b0180c23758711182e177f2b22bec0f90a97680446b64"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "9d3a4d0dec14e3279d7f0781a2a5a316184b0e6d853a8721562aa8161b92d60a"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "fb1cc7681d1f0734899f2397d4e96295e8496bd6b9f5e664518a5a4f815593d3"},
    {"paper renders", "69489ad545e972d162043ff66bb02731b10c7f02530ad977ee8f1da317c9a1e0"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
